// 3D views: a surface and the medial meshes of its results, two next to each other with one camera.
//
// A view is made when it is opened and disposed of when it is closed or another one is opened: browsers keep few
// contexts. Its numbers are part of the page, or a script file next to it, which also a page from a disk may load.
const viewOf = (() => {
  // Sides of a tube, and how finely spheres are cut, such that a page can hold all of them.
  const SIDES = [3, 24];
  const ALL_SIDES = 150000;
  const MANY_BALLS = 1000;
  // Browsers keep few contexts: further results are in the lists.
  const MOST_SIDES = 6;

  // The text of a view, from the page or from its file.
  const arriving = new Map();
  window.medialView = (name, text) => arriving.get(name)?.(text);
  const textOf = ({ name, file }) => {
    const inside = document.getElementById(`view-${name}`);
    if (inside) return Promise.resolve(inside.textContent);
    return new Promise((resolve, reject) => {
      const script = make("script", { src: file });
      arriving.set(name, resolve);
      script.addEventListener("error", () => reject(new Error(`${file} is missing`)));
      script.addEventListener("load", () => script.remove());
      document.head.append(script);
    });
  };

  let library;
  const loadLibrary = async () => {
    const address = (code) => URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
    const three = address(await unpackedText("three"));
    // The module names three.js by a bare word, which only an import map could resolve.
    const controls = (await unpackedText("controls")).replace("'three'", `'${three}'`);
    return { ...(await import(three)), ...(await import(address(controls))) };
  };

  // A view of reports/view3d.rs with typed arrays.
  const read = (text) => {
    const view = JSON.parse(text);
    const indices = Uint32Array.from(view.faces);
    for (let k = 1; k < indices.length; k += 1) indices[k] += indices[k - 1];
    const positions = Float32Array.from(view.vertices, (step, k) => view.low[k % 3] + view.step * step);
    for (const result of view.results) {
      result.spheres = Float32Array.from(result.spheres);
      for (const key of ["edges", "faces", "seams", "junctions"]) result[key] = Uint32Array.from(result[key]);
    }
    return { ...view, indices, positions };
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
    // Each sheet in its colour, seams as black tubes that meet in balls.
    const sheets = (result) => {
      const soup = new Soup();
      const thick = 0.003 * view.diagonal;
      const black = colour(2, 1);
      simplices(result.faces, 3).forEach((face, k) => {
        const corners = face.map((v) => sphereOf(result, v).centre);
        const [a, b, c] = corners;
        const normal = unit(cross(subtract(b, a), subtract(c, a)));
        for (const corner of corners) soup.corner(corner, normal, colour(2, result.sheets[k] / 255));
      });
      for (const edge of simplices(result.seams, 2)) {
        const [a, b] = edge.map((v) => sphereOf(result, v).centre);
        tube(soup, 6, a, b, [thick, thick], 0, [black, black]);
      }
      const balls = [...result.junctions].map((v) => {
        const ball = new T.Mesh(new T.IcosahedronGeometry(2.4 * thick, 2), new T.MeshLambertMaterial({ color: 0x101010 }));
        ball.position.set(...sphereOf(result, v).centre);
        return ball;
      });
      return [coloured(soup), ...balls, glass()];
    };
    // The union: the depth buffer removes hidden parts of primitives.
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
    return { axis, sheets, union, errors: (result) => [errors(result)], surface: () => [surface()] };
  };

  const KINDS = [
    ["axis", "medial mesh"],
    ["sheets", "sheets and seams"],
    ["union", "reconstruction"],
    ["errors", "error on the surface"],
    ["surface", "surface"],
  ];
  const percent = (value) => `${Number(value.toPrecision(2))} %`;

  // One camera for both sides. The content of the first view decides its width.
  const cameraOf = (T, view) => {
    const camera = new T.OrthographicCamera();
    const direction = new T.Vector3(...view.direction).normalize();
    const box = new T.Box3().setFromArray(view.positions);
    const target = box.getCenter(new T.Vector3());
    camera.up.set(...view.up).normalize();
    camera.position.copy(target).addScaledVector(direction, 3 * view.diagonal);
    [camera.near, camera.far] = [0.01 * view.diagonal, 6 * view.diagonal];
    const across = new T.Vector3().crossVectors(camera.up, direction).normalize();
    const half = [across, new T.Vector3().crossVectors(direction, across)].map((axis) => {
      let most = 0;
      const point = new T.Vector3();
      for (let k = 0; k < view.positions.length; k += 3) {
        most = Math.max(most, Math.abs(point.fromArray(view.positions, k).sub(target).dot(axis)));
      }
      return 1.08 * most;
    });
    return { camera, target, half };
  };

  class Side {
    constructor(T, view, eye, chosen, changed) {
      const select = (label, options, value) => {
        const list = make("select", { "aria-label": label }, ...options.map(([key, text]) => new Option(text, key)));
        list.value = value;
        list.addEventListener("change", () => this.choose());
        return list;
      };
      this.of = select("result", view.results.map((result, k) => [k, result.label]), chosen[0]);
      // Without a surface there are the medial meshes alone.
      this.kind = select("quantity", view.indices.length ? KINDS : KINDS.slice(0, 3), chosen[1]);
      this.canvas = make("canvas", { tabindex: 0 });
      this.caption = make("figcaption");
      this.figure = make("figure", { class: "side" }, make("div", { class: "bar" }, this.of, this.kind), this.canvas, this.caption);
      // Preserved, so that the picture can be copied out of the page.
      this.renderer = new T.WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
      this.scene = new T.Scene();
      this.light = new T.DirectionalLight(0xffffff, 2.1);
      this.scene.add(this.light, new T.HemisphereLight(0xffffff, 0xb8bcc4, 1.5));
      this.controls = new T.OrbitControls(eye.camera, this.canvas);
      Object.assign(this.controls, { target: eye.target, enableZoom: false, minZoom: 0.3, maxZoom: 40 });
      this.controls.saveState();
      Object.assign(this, { T, view, eye, changed, build: scenes(T, view), shown: [] });
      this.listen();
      this.choose();
    }

    choose() {
      this.clear();
      const kind = this.kind.value;
      const result = this.view.results[this.of.value];
      this.shown = this.build[kind](result);
      this.scene.add(...this.shown);
      const { largest_error: end, radii, diagonal } = this.view;
      const [least, most] = radii.map((radius) => percent((100 * radius) / diagonal));
      this.caption.textContent = {
        errors: `red: the reconstruction reaches beyond, blue: it falls short; errors above ${percent(end)} of the diagonal have the last colour`,
        surface: "the input",
        sheets: `${["sheets", "seams", "junctions"].map((word, k) => `${result.structure[k]} ${word}`).join(", ")}; seams are black`,
      }[kind] ?? `colour: radius, ${least} to ${most} of the diagonal`;
      this.of.disabled = kind === "surface";
      const name = KINDS.find(([key]) => key === kind)[1];
      this.canvas.setAttribute("aria-label", `${result.label}, ${name}: arrow keys turn, plus and minus zoom, 0 resets`);
      this.changed();
    }

    draw() {
      const { clientWidth: width, clientHeight: height } = this.canvas;
      if (!width || !height) return;
      const { T, eye: { camera, target, half } } = this;
      const size = Math.max(half[0] / width, half[1] / height);
      [camera.left, camera.right, camera.top, camera.bottom] = [-width * size, width * size, height * size, -height * size];
      camera.lookAt(target);
      camera.updateProjectionMatrix();
      const back = new T.Vector3().subVectors(camera.position, target).normalize();
      const across = new T.Vector3().crossVectors(camera.up, back).normalize();
      this.light.position.copy(back).addScaledVector(across, -0.45).addScaledVector(camera.up, 0.6);
      this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
      this.renderer.setSize(width, height, false);
      this.renderer.render(this.scene, camera);
    }

    listen() {
      const { T, canvas, controls, eye: { camera, target } } = this;
      controls.addEventListener("change", this.changed);
      canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
      // The wheel scrolls the page until the view has the focus.
      canvas.addEventListener("focus", () => (controls.enableZoom = true));
      canvas.addEventListener("blur", () => (controls.enableZoom = false));
      canvas.addEventListener("dblclick", () => controls.reset());
      canvas.addEventListener("keydown", (event) => {
        const turn = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
        const zoom = { "+": 1.15, "=": 1.15, "-": 1 / 1.15 }[event.key];
        if (turn) {
          const back = camera.position.clone().sub(target);
          const across = new T.Vector3().crossVectors(camera.up, back).normalize();
          // Never over the pole, where up and the line of sight are one.
          const lift = Math.min(back.angleTo(camera.up) - 0.02, Math.max(back.angleTo(camera.up) - 3.12, turn[1]));
          back.applyAxisAngle(across, -lift).applyAxisAngle(camera.up, -turn[0]);
          camera.position.copy(target).add(back);
        } else if (zoom) {
          camera.zoom = Math.min(40, Math.max(0.3, camera.zoom * zoom));
        } else if (event.key === "0") {
          controls.reset();
        } else {
          return;
        }
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
      this.controls.dispose();
      this.renderer.dispose();
      this.renderer.forceContextLoss();
    }
  }

  let close = () => {};
  const open = async (place, button, source) => {
    close();
    const say = place.appendChild(make("p", { class: "note", role: "status" }, "loading …"));
    button.disabled = true;
    let sides = [];
    try {
      const text = await textOf(source);
      library ??= loadLibrary();
      const T = await library;
      const view = read(await unpacked(text).text());
      const eye = cameraOf(T, view);
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
      const second = view.indices.length ? "errors" : "union";
      const all = view.results.slice(0, MOST_SIDES).map((_, k) => [String(k), "axis"]);
      const firsts = view.results.length < 2 ? [["0", "axis"], ["0", second]] : source.all ? all : [["0", "axis"], [last, "axis"]];
      for (const chosen of firsts) sides.push(new Side(T, view, eye, chosen, changed));
      const panel = make("div", { class: "sides" }, ...sides.map((side) => side.figure));
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

  return (source) => {
    const button = make("button", { type: "button", "aria-expanded": "false" }, "show in 3D");
    const place = make("div", { class: "view3d" }, button);
    button.addEventListener("click", () => {
      if (button.getAttribute("aria-expanded") === "true") {
        close();
        return;
      }
      for (const old of place.querySelectorAll(".note")) old.remove();
      open(place, button, source);
    });
    if (source.all) {
      button.hidden = true;
      open(place, button, source);
    }
    return place;
  };
})();
