// 3D views: a surface and the medial meshes of its results, two beside each other with one camera.
//
// A view is made when it is opened and disposed of when it is closed or another one is opened: browsers keep few
// contexts. Its numbers stand in the page, or in a script file beside it, which also a page from a disk may load.
(() => {
  // Sides of a tube, and how finely spheres are cut: of so many that a page can hold them.
  const SIDES = [3, 24];
  const ALL_SIDES = 150000;
  const MANY_BALLS = 1000;
  const make = (tag, className, text) => {
    const element = document.createElement(tag);
    if (className) element.className = className;
    if (text !== undefined) element.textContent = text;
    return element;
  };

  // The text of a view, from the page or from its file.
  const arriving = new Map();
  window.medialView = (name, text) => arriving.get(name)?.(text);
  const textOf = (name, source) => {
    const inside = document.getElementById(`view-${name}`);
    if (inside) return Promise.resolve(inside.textContent);
    return new Promise((resolve, reject) => {
      const script = make("script");
      arriving.set(name, resolve);
      script.addEventListener("error", () => reject(new Error(`${source} is not there`)));
      script.addEventListener("load", () => script.remove());
      script.src = source;
      document.head.append(script);
    });
  };

  let library;
  const loadLibrary = async () => {
    const code = await page.unpack(document.getElementById("three"));
    const address = URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
    try {
      return await import(address);
    } finally {
      URL.revokeObjectURL(address);
    }
  };

  // The arrays of a view, in the order that reports/view3d.rs tells.
  const read = (buffer) => {
    const length = new DataView(buffer).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    let at = 4 + length;
    const take = (type, count) => {
      const array = new type(buffer, at, count);
      at += array.byteLength;
      return array;
    };
    const [vertices, faces] = head.surface;
    const indices = take(Uint32Array, 3 * faces);
    for (let k = 1; k < indices.length; k += 1) indices[k] += indices[k - 1];
    const results = head.results.map(({ label, counts: [n, e, f] }) => ({
      label,
      spheres: take(Float32Array, 4 * n),
      edges: take(Uint32Array, 2 * e),
      faces: take(Uint32Array, 3 * f),
    }));
    const steps = take(Uint16Array, 3 * vertices);
    const positions = Float32Array.from(steps, (step, k) => head.low[k % 3] + head.step * step);
    for (const result of results) result.errors = take(Uint8Array, vertices);
    return { ...head, indices, positions, results };
  };

  // Triangles with normals and colours, one after the other.
  class Soup {
    constructor() {
      [this.positions, this.normals, this.colours] = [[], [], []];
    }
    corner(p, n, c) {
      this.positions.push(...p);
      this.normals.push(...n);
      this.colours.push(...c);
    }
    geometry(T) {
      const geometry = new T.BufferGeometry();
      const parts = { position: this.positions, normal: this.normals, color: this.colours };
      for (const [name, list] of Object.entries(parts)) {
        geometry.setAttribute(name, new T.Float32BufferAttribute(list, 3));
      }
      return geometry;
    }
  }

  const subtract = (a, b) => a.map((x, k) => x - b[k]);
  const along = (a, b, t) => a.map((x, k) => x + t * b[k]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const scaled = (a, t) => a.map((x) => t * x);
  const unit = (a) => scaled(a, 1 / (Math.hypot(...a) || 1));

  const scenes = (T, view) => {
    const colour = (table, share) => {
      const list = view.colours[table];
      const place = Math.round(Math.min(1, Math.max(0, share)) * (list.length - 1));
      const at = new T.Color();
      at.setRGB(...list[place].map((code) => code / 255), T.SRGBColorSpace);
      return [at.r, at.g, at.b];
    };
    const [least, most] = view.radii;
    const byRadius = (radius) => colour(0, most > least ? (radius - least) / (most - least) : 0.5);
    const sphereOf = (result, v) => ({
      centre: [...result.spheres.subarray(4 * v, 4 * v + 3)],
      radius: result.spheres[4 * v + 3],
    });
    const simplices = (list, size) =>
      Array.from({ length: list.length / size }, (_, k) => [...list.subarray(size * k, size * k + size)]);

    const surfaceGeometry = () => {
      const geometry = new T.BufferGeometry();
      geometry.setAttribute("position", new T.BufferAttribute(view.positions, 3));
      geometry.setIndex(new T.BufferAttribute(view.indices, 1));
      return geometry;
    };
    const surface = () =>
      new T.Mesh(surfaceGeometry(), new T.MeshLambertMaterial({ color: 0xcfd3d8, flatShading: true, side: T.DoubleSide }));
    // Clear where it is seen from the front, denser towards its outlines.
    const glass = () => {
      const geometry = surfaceGeometry();
      geometry.computeVertexNormals();
      const isDark = window.matchMedia("(prefers-color-scheme: dark)").matches;
      const tint = isDark ? "0.75, 0.8, 0.86" : "0.33, 0.4, 0.48";
      const material = new T.ShaderMaterial({
        vertexShader: `varying float slant;
          void main() {
            slant = 1.0 - abs(normalize(normalMatrix * normal).z);
            gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
          }`,
        fragmentShader: `varying float slant;
          void main() { gl_FragColor = vec4(${tint}, 0.04 + 0.4 * pow(slant, 3.0)); }`,
        transparent: true, depthWrite: false, side: T.DoubleSide,
      });
      return new T.Mesh(geometry, material);
    };
    const errors = (result) => {
      const geometry = surfaceGeometry();
      const table = Array.from({ length: 256 }, (_, code) => colour(1, (code - 1) / 254));
      const colours = new Float32Array(3 * result.errors.length);
      result.errors.forEach((code, v) => colours.set(table[code], 3 * v));
      geometry.setAttribute("color", new T.BufferAttribute(colours, 3));
      const material = new T.MeshLambertMaterial({ vertexColors: true, flatShading: true, side: T.DoubleSide });
      return new T.Mesh(geometry, material);
    };
    const balls = (result, sizeOf) => {
      const count = result.spheres.length / 4;
      const ball = new T.IcosahedronGeometry(1, count < MANY_BALLS ? 4 : 1);
      const mesh = new T.InstancedMesh(ball, new T.MeshLambertMaterial(), count);
      const place = new T.Matrix4();
      for (let v = 0; v < count; v += 1) {
        const { centre, radius } = sphereOf(result, v);
        const size = sizeOf(radius);
        place.makeScale(size, size, size).setPosition(...centre);
        mesh.setMatrixAt(v, place);
        mesh.setColorAt(v, new T.Color(...byRadius(radius)));
      }
      return mesh;
    };
    // A tube from one circle to another; circles of two spheres touch the cone around both.
    const sidesOf = (result) =>
      Math.min(SIDES[1], Math.max(SIDES[0], Math.floor((2 * ALL_SIDES) / (1 + result.edges.length))));
    const tube = (soup, sides, a, b, [radiusA, radiusB], lean, colours) => {
      const axis = unit(subtract(b, a));
      const across = unit(cross(axis, Math.abs(axis[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
      const third = cross(axis, across);
      const around = Array.from({ length: sides + 1 }, (_, k) => {
        const angle = (2 * Math.PI * k) / sides;
        return along(scaled(across, Math.cos(angle)), third, Math.sin(angle));
      });
      const straight = Math.sqrt(1 - lean * lean);
      for (let k = 0; k < sides; k += 1) {
        const [u, v] = [around[k], around[k + 1]];
        const normal = (w) => along(scaled(w, straight), axis, lean);
        const [p, q] = [[along(a, u, radiusA), along(a, v, radiusA)], [along(b, u, radiusB), along(b, v, radiusB)]];
        const corners = [[p[0], u, 0], [p[1], v, 0], [q[1], v, 1], [p[0], u, 0], [q[1], v, 1], [q[0], u, 1]];
        for (const [at, w, end] of corners) soup.corner(at, normal(w), colours[end]);
      }
    };
    const coloured = (soup) =>
      new T.Mesh(soup.geometry(T), new T.MeshLambertMaterial({ vertexColors: true, side: T.DoubleSide }));
    const axis = (result) => {
      const soup = new Soup();
      const thin = 0.0016 * view.diagonal;
      const sides = sidesOf(result);
      for (const edge of simplices(result.edges, 2)) {
        const [a, b] = edge.map((v) => sphereOf(result, v));
        tube(soup, sides, a.centre, b.centre, [thin, thin], 0, [a, b].map((s) => scaled(byRadius(s.radius), 0.4)));
      }
      for (const face of simplices(result.faces, 3)) {
        const corners = face.map((v) => sphereOf(result, v));
        const [a, b, c] = corners.map((s) => s.centre);
        const normal = unit(cross(subtract(b, a), subtract(c, a)));
        for (const s of corners) soup.corner(s.centre, normal, byRadius(s.radius));
      }
      return [coloured(soup), balls(result, () => 2.4 * thin), glass()];
    };
    // The union: what primitives hide of each other, the depth buffer hides.
    const union = (result) => {
      const soup = new Soup();
      const sides = sidesOf(result);
      for (const edge of simplices(result.edges, 2)) {
        const [a, b] = edge.map((v) => sphereOf(result, v));
        const between = subtract(b.centre, a.centre);
        const lean = (a.radius - b.radius) / Math.hypot(...between);
        if (!(Math.abs(lean) < 1)) continue;
        const straight = Math.sqrt(1 - lean * lean);
        const direction = unit(between);
        const [p, q] = [a, b].map((s) => along(s.centre, direction, s.radius * lean));
        tube(soup, sides, p, q, [a.radius * straight, b.radius * straight], lean, [a, b].map((s) => byRadius(s.radius)));
      }
      for (const face of simplices(result.faces, 3)) {
        const [a, b, c] = face.map((v) => sphereOf(result, v));
        // The normal n of a plane that touches all three: n (b - a) = r_a - r_b, and the same for c.
        const [x, y] = [b, c].map((s) => subtract(s.centre, a.centre));
        const [s, t] = [b, c].map((other) => a.radius - other.radius);
        const upward = cross(x, y);
        const area = dot(upward, upward);
        const flat = scaled(along(scaled(cross(y, upward), s), cross(upward, x), t), 1 / area);
        const rest = 1 - dot(flat, flat);
        if (!(rest > 0)) continue;
        for (const side of [1, -1]) {
          const normal = along(flat, upward, (side * Math.sqrt(rest)) / Math.sqrt(area));
          for (const ball of [a, b, c]) {
            soup.corner(along(ball.centre, normal, ball.radius), normal, byRadius(ball.radius));
          }
        }
      }
      return [coloured(soup), balls(result, (radius) => radius)];
    };
    return { axis, union, errors: (result) => [errors(result)], surface: () => [surface()] };
  };

  const KINDS = [
    ["axis", "medial mesh"],
    ["union", "reconstruction"],
    ["errors", "error on the surface"],
    ["surface", "surface"],
  ];
  const percent = (value) => `${Number(value.toPrecision(2))} %`;

  // One camera for both sides: angles around the upward direction, a zoom, and what it looks at.
  const cameraOf = (T, view) => {
    const up = new T.Vector3(...view.up).normalize();
    const direction = new T.Vector3(...view.direction).normalize();
    const front = direction.clone().addScaledVector(up, -direction.dot(up)).normalize();
    const right = up.clone().cross(front);
    const box = new T.Box3().setFromArray(view.positions);
    const middle = box.getCenter(new T.Vector3());
    // What the picture must hold in the first view, to the sides and upwards.
    const seen = [new T.Vector3().crossVectors(up, direction).normalize()];
    seen.push(new T.Vector3().crossVectors(direction, seen[0]));
    const point = new T.Vector3();
    const half = seen.map((axis) => {
      let most = 0;
      for (let k = 0; k < view.positions.length; k += 3) {
        most = Math.max(most, Math.abs(point.fromArray(view.positions, k).sub(middle).dot(axis)));
      }
      return 1.08 * most;
    });
    const first = { turn: 0, lift: Math.asin(direction.dot(up)), zoom: 1, target: middle.clone() };
    const state = { ...first, target: middle.clone() };
    const back = () =>
      front.clone().multiplyScalar(Math.cos(state.turn)).addScaledVector(right, Math.sin(state.turn))
        .multiplyScalar(Math.cos(state.lift)).addScaledVector(up, Math.sin(state.lift));
    return {
      state,
      turn(x, y) {
        state.turn -= x;
        state.lift = Math.min(1.55, Math.max(-1.55, state.lift + y));
      },
      pan(x, y) {
        const across = up.clone().cross(back()).normalize();
        const upward = back().cross(across);
        const units = state.unitsPerPixel;
        state.target.addScaledVector(across, -x * units).addScaledVector(upward, y * units);
      },
      zoom(factor) {
        state.zoom = Math.min(40, Math.max(0.3, state.zoom * factor));
      },
      reset() {
        Object.assign(state, first, { target: middle.clone() });
      },
      place(camera, light, width, height) {
        const unitsPerPixel = Math.max((2 * half[0]) / width, (2 * half[1]) / height) / state.zoom;
        const [x, y] = [0.5 * unitsPerPixel * width, 0.5 * unitsPerPixel * height];
        state.unitsPerPixel = unitsPerPixel;
        [camera.left, camera.right, camera.top, camera.bottom] = [-x, x, y, -y];
        [camera.near, camera.far] = [0.01 * view.diagonal, 6 * view.diagonal];
        camera.up.copy(up);
        camera.position.copy(state.target).addScaledVector(back(), 3 * view.diagonal);
        camera.lookAt(state.target);
        camera.updateProjectionMatrix();
        const across = up.clone().cross(back()).normalize();
        light.position.copy(back()).addScaledVector(across, -0.45).addScaledVector(up, 0.6);
      },
    };
  };

  class Side {
    constructor(T, view, camera, chosen, changed) {
      this.figure = make("figure", "side");
      const bar = this.figure.appendChild(make("div", "bar"));
      const select = (label, options, value) => {
        const box = bar.appendChild(make("select"));
        box.setAttribute("aria-label", label);
        options.forEach(([key, text]) => box.add(new Option(text, key)));
        box.value = value;
        box.addEventListener("change", () => this.choose());
        return box;
      };
      this.of = select("result", view.results.map((result, k) => [k, result.label]), chosen[0]);
      this.kind = select("what is shown", KINDS, chosen[1]);
      this.canvas = this.figure.appendChild(make("canvas"));
      this.canvas.tabIndex = 0;
      this.caption = this.figure.appendChild(make("figcaption"));
      // Kept, so that the picture can be copied out of the page.
      this.renderer = new T.WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
      this.scene = new T.Scene();
      this.eye = new T.OrthographicCamera();
      this.light = new T.DirectionalLight(0xffffff, 2.1);
      this.scene.add(this.light, new T.HemisphereLight(0xffffff, 0xb8bcc4, 1.5));
      Object.assign(this, { view, camera, changed, build: scenes(T, view), shown: [] });
      this.listen();
      this.choose();
    }

    choose() {
      this.clear();
      const kind = this.kind.value;
      const result = this.view.results[this.of.value];
      this.shown = this.build[kind](result);
      this.scene.add(...this.shown);
      const name = KINDS.find(([key]) => key === kind)[1];
      const { largest_error: end, radii, diagonal } = this.view;
      const scale = {
        axis: `colour: radius, ${percent((100 * radii[0]) / diagonal)} to ${percent((100 * radii[1]) / diagonal)} of the diagonal`,
        union: `colour: radius, ${percent((100 * radii[0]) / diagonal)} to ${percent((100 * radii[1]) / diagonal)} of the diagonal`,
        errors: `red: the reconstruction reaches beyond, blue: it falls short; full colour from ${percent(end)} of the diagonal`,
        surface: "the input",
      }[kind];
      this.caption.textContent = scale;
      this.of.disabled = kind === "surface";
      this.canvas.setAttribute("aria-label", `${result.label}, ${name}: arrow keys turn, plus and minus zoom, 0 resets`);
      this.changed();
    }

    draw() {
      const { clientWidth: width, clientHeight: height } = this.canvas;
      if (!width || !height) return;
      this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
      this.renderer.setSize(width, height, false);
      this.camera.place(this.eye, this.light, width, height);
      this.renderer.render(this.scene, this.eye);
    }

    listen() {
      const { canvas, camera } = this;
      const held = new Map();
      canvas.addEventListener("pointerdown", (event) => {
        held.set(event.pointerId, [event.clientX, event.clientY]);
        canvas.setPointerCapture(event.pointerId);
        canvas.focus({ preventScroll: true });
        event.preventDefault();
      });
      canvas.addEventListener("pointermove", (event) => {
        const from = held.get(event.pointerId);
        if (!from) return;
        const to = [event.clientX, event.clientY];
        const [x, y] = subtract(to, from);
        const other = [...held].find(([id]) => id !== event.pointerId)?.[1];
        if (other) {
          const apart = (at) => Math.hypot(...subtract(at, other)) || 1;
          camera.zoom(apart(to) / apart(from));
        } else if (event.shiftKey || event.buttons === 2) {
          camera.pan(x, y);
        } else {
          camera.turn(x * 0.008, y * 0.008);
        }
        held.set(event.pointerId, to);
        this.changed();
      });
      for (const type of ["pointerup", "pointercancel"]) {
        canvas.addEventListener(type, (event) => held.delete(event.pointerId));
      }
      canvas.addEventListener("contextmenu", (event) => event.preventDefault());
      // The wheel scrolls the page until the view was touched.
      canvas.addEventListener(
        "wheel",
        (event) => {
          if (document.activeElement !== canvas) return;
          event.preventDefault();
          camera.zoom(Math.exp(-0.0015 * event.deltaY));
          this.changed();
        },
        { passive: false },
      );
      canvas.addEventListener("dblclick", () => {
        camera.reset();
        this.changed();
      });
      canvas.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
        if (step && event.shiftKey) camera.pan(...step.map((x) => 20 * x));
        else if (step) camera.turn(...step.map((x) => 0.1 * x));
        else if (event.key === "+" || event.key === "=") camera.zoom(1.15);
        else if (event.key === "-") camera.zoom(1 / 1.15);
        else if (event.key === "0") camera.reset();
        else return;
        event.preventDefault();
        this.changed();
      });
    }

    clear() {
      for (const object of this.shown) {
        this.scene.remove(object);
        object.geometry.dispose();
        object.material.dispose();
        object.dispose?.();
      }
    }

    dispose() {
      this.clear();
      this.renderer.dispose();
      this.renderer.forceContextLoss();
    }
  }

  let close = () => {};
  const open = async (place, button) => {
    close();
    const say = place.appendChild(make("p", "note", "loading …"));
    say.setAttribute("role", "status");
    button.disabled = true;
    let sides = [];
    try {
      const text = await textOf(place.dataset.view, place.dataset.src);
      library ??= loadLibrary();
      const T = await library;
      const view = read(await page.unpackBytes(text));
      const camera = cameraOf(T, view);
      let waiting = false;
      const changed = () => {
        if (waiting) return;
        waiting = true;
        requestAnimationFrame(() => {
          waiting = false;
          sides.forEach((side) => side.draw());
        });
      };
      const last = String(view.results.length - 1);
      const firsts = view.results.length > 1 ? [["0", "axis"], [last, "axis"]] : [["0", "axis"], ["0", "errors"]];
      for (const chosen of firsts) sides.push(new Side(T, view, camera, chosen, changed));
      const panel = make("div", "sides");
      panel.append(...sides.map((side) => side.figure));
      place.append(panel);
      const observer = new ResizeObserver(changed);
      sides.forEach((side) => observer.observe(side.canvas));
      close = () => {
        observer.disconnect();
        sides.forEach((side) => side.dispose());
        panel.remove();
        button.setAttribute("aria-expanded", "false");
        button.textContent = "show in 3D";
        close = () => {};
      };
      button.setAttribute("aria-expanded", "true");
      button.textContent = "close 3D";
      say.remove();
    } catch (error) {
      sides.forEach((side) => side.dispose());
      say.textContent = `No 3D view: ${error.message}.`;
    }
    button.disabled = false;
  };

  page.enlivenViews = (root) => {
    for (const place of root.querySelectorAll("div.view3d")) {
      const button = make("button", "", "show in 3D");
      button.type = "button";
      button.setAttribute("aria-expanded", "false");
      button.addEventListener("click", () => {
        if (button.getAttribute("aria-expanded") === "true") {
          close();
          return;
        }
        for (const note of place.querySelectorAll(".note")) note.remove();
        open(place, button);
      });
      place.append(button);
    }
  };
  page.enlivenViews(document);
})();
