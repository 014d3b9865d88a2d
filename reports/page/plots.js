// Plots that answer: values under the pointer or at the keyboard's point, series to hide, an area
// to enlarge. The drawing is the one in the file; the script only moves and hides its parts.
(() => {
  const MOST_ENLARGED = 200;
  const SVG = "http://www.w3.org/2000/svg";
  const draw = (tag, attributes, parent) => {
    const element = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    return parent.appendChild(element);
  };
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  tip.setAttribute("role", "status");
  document.body.append(tip);
  const format = (value) => Number(value.toPrecision(4)).toLocaleString("en", { maximumSignificantDigits: 4 });

  // Of an axis, with a gap: ticks closer than their labels are too many.
  const WIDTH_OF_LETTER = 0.018;
  // Round numbers within a range of an axis, as few as stay readable.
  const ticksOf = (scale, low, high) => {
    const step = (least) => {
      const power = 10 ** Math.floor(Math.log10(least));
      return power * [1, 2, 5, 10].find((digit) => digit * power >= least * 0.999);
    };
    if (scale !== "linear" && high > 3 * Math.max(low, 1e-300)) {
      const decades = [];
      const last = Math.ceil(Math.log10(high));
      const first = low > 0 ? Math.floor(Math.log10(low)) : 0;
      for (let decade = first; decade <= last; decade += 1) decades.push(10 ** decade);
      for (const digits of [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1, 3], [1]]) {
        const values = decades.flatMap((decade) => digits.map((digit) => digit * decade));
        if (low <= 0) values.unshift(0);
        const within = values.filter((value) => value >= low && value <= high);
        const share = (value) => (lay(scale, value) - lay(scale, low)) / (lay(scale, high) - lay(scale, low));
        const close = within.some((value, k) => {
          const letters = value.toLocaleString("en").length;
          return k > 0 && share(value) - share(within[k - 1]) < WIDTH_OF_LETTER * letters;
        });
        if ((within.length <= 8 && !close) || digits.length === 1) return within;
      }
    }
    const by = step((high - low) / 5);
    const values = [];
    for (let k = Math.ceil(low / by); k * by <= high; k += 1) values.push(k * by);
    return values;
  };
  const unlay = (scale, value) =>
    scale === "linear" ? value : scale === "log" ? 10 ** value : Math.max(0, 10 ** value - 1);
  const lay = (scale, value) =>
    scale === "linear" ? value : Math.log10(scale === "log" ? value : 1 + value);

  const enliven = (figure, svg, plot) => {
    const [left, top, right, bottom] = plot.area;
    const whole = [left, top, right, bottom];
    const hidden = new Set();
    let view = whole;
    let current = null;
    const place = ([x, y]) => [
      left + ((x - view[0]) / (view[2] - view[0])) * (right - left),
      top + ((y - view[1]) / (view[3] - view[1])) * (bottom - top),
    ];
    const inside = ([x, y]) => x >= left - 1 && x <= right + 1 && y >= top - 1 && y <= bottom + 1;
    const points = plot.curves.flatMap((curve) => curve.points.map((at) => ({ curve, at })));
    const seen = () =>
      points.filter((point) => !hidden.has(point.curve.series) && inside(place(point.at)));
    const marks = [...svg.querySelectorAll("g.marks")].map((group) => [...group.children]);
    const parts = (selector) => [...svg.querySelectorAll(selector)];
    const [axes, lines, tags, fronts] = ["g.axes", "g.line", "g.tags", "g.front"].map(parts);
    const overlay = draw("g", { class: "overlay" }, svg);
    const ring = draw("circle", { r: 13, class: "ring", visibility: "hidden" }, svg);
    const frame = draw("rect", { class: "frame", visibility: "hidden" }, svg);

    const say = ({ curve, at }) => {
      const [, , x, y, n, spheres, isFront] = at;
      const of = n === null ? "" : n === 1 ? "n = 1 mesh" : `n = ${n} meshes`;
      const values = [`${plot.x.title}: ${format(x)}`, `${plot.y.title}: ${format(y)}`];
      if (spheres !== null) values.push(`spheres: ${format(spheres)}`);
      return [curve.name, [curve.of, of].filter(Boolean).join(", "), ...values, isFront ? "not dominated" : ""]
        .filter(Boolean);
    };
    const toScreen = ([x, y]) => {
      const box = svg.getBoundingClientRect();
      const scale = box.width / svg.viewBox.baseVal.width;
      return [box.left + x * scale, box.top + y * scale];
    };
    const forget = () => {
      current = null;
      tip.hidden = true;
      ring.setAttribute("visibility", "hidden");
    };
    const tell = (point) => {
      current = point;
      const at = place(point.at);
      ring.setAttribute("cx", at[0]);
      ring.setAttribute("cy", at[1]);
      ring.setAttribute("visibility", "visible");
      const texts = say(point);
      const here = seen().filter((other) => Math.hypot(...place(other.at).map((v, k) => v - at[k])) < 4);
      if (here.length > 1) {
        const others = [...new Set(here.map((other) => other.curve.name))].filter((name) => name !== point.curve.name);
        if (others.length) texts.push(`also here: ${others.slice(0, 4).join(", ")}`);
      }
      tip.replaceChildren(
        ...texts.map((text, index) => {
          const line = document.createElement(index ? "div" : "strong");
          line.textContent = text;
          return line;
        }),
      );
      tip.hidden = false;
      const [x, y] = toScreen(at);
      const room = document.documentElement.clientWidth;
      const { width, height } = tip.getBoundingClientRect();
      tip.style.left = `${Math.max(4, x + 14 + width > room ? Math.min(x - width - 14, room - width - 4) : x + 14)}px`;
      tip.style.top = `${Math.max(4, y - height - 10)}px`;
    };
    const nearest = (event, reach) => {
      let best = null;
      let least = reach;
      for (const point of seen()) {
        const [x, y] = toScreen(place(point.at));
        const distance = Math.hypot(x - event.clientX, y - event.clientY);
        if (distance < least) [best, least] = [point, distance];
      }
      return best;
    };

    // An enlarged area: marks move, lines and axes are drawn anew.
    const pathOf = (list) => list.map((at) => place(at).join(",")).join(" ");
    const clip = `clip-${Math.random().toString(36).slice(2)}`;
    const redraw = () => {
      forget();
      const isWhole = view === whole;
      for (const part of [...axes, ...lines, ...tags, ...fronts]) {
        part.style.display = !isWhole || hidden.has(part.dataset.series) ? "none" : "";
      }
      marks.forEach((list, index) => {
        const curve = plot.curves[index];
        list.forEach((mark, k) => {
          const [x, y] = place(curve.points[k]);
          const away = hidden.has(curve.series) || !inside([x, y]);
          mark.style.display = away ? "none" : "";
          mark.setAttribute("transform", `translate(${x - curve.points[k][0]} ${y - curve.points[k][1]})`);
        });
      });
      overlay.replaceChildren();
      reset.hidden = isWhole;
      if (isWhole) return;
      // Beneath the marks.
      svg.insertBefore(overlay, svg.querySelector("g.line"));
      const path = draw("clipPath", { id: clip }, draw("defs", {}, overlay));
      draw("rect", { x: left, y: top, width: right - left, height: bottom - top }, path);
      const ink = "#202124";
      const words = (text, attributes) => {
        const element = draw("text", { fill: ink, "font-family": "sans-serif", "font-size": 24, ...attributes }, overlay);
        element.textContent = text;
      };
      const axis = (of, from, to, across) => {
        const { scale, ends } = plot[of];
        const share = (at) => (across ? (at - left) / (right - left) : (bottom - at) / (bottom - top));
        const laid = [from, to].map((at) => ends[0] + share(at) * (ends[1] - ends[0]));
        const [low, high] = laid.map((value) => unlay(scale, value));
        for (const tick of ticksOf(scale, low, high)) {
          const part = (lay(scale, tick) - laid[0]) / (laid[1] - laid[0]);
          const at = across ? left + part * (right - left) : bottom - part * (bottom - top);
          const text = Number(tick.toPrecision(6)).toLocaleString("en", { maximumSignificantDigits: 6 });
          draw("line", across ? { x1: at, x2: at, y1: top, y2: bottom, stroke: "#E3E5E8", "stroke-width": 2 }
            : { x1: left, x2: right, y1: at, y2: at, stroke: "#E3E5E8", "stroke-width": 2 }, overlay);
          if (across) words(text, { x: at, y: bottom + 34, "text-anchor": "middle" });
          else words(text, { x: left - 14, y: at + 8, "text-anchor": "end" });
        }
      };
      axis("x", view[0], view[2], true);
      axis("y", view[3], view[1], false);
      draw("polyline", { points: `${left},${top} ${left},${bottom} ${right},${bottom}`, fill: "none", stroke: ink, "stroke-width": 2 }, overlay);
      words(plot.x.title, { x: (left + right) / 2, y: bottom + 84, "text-anchor": "middle", "font-size": 26 });
      const middle = (top + bottom) / 2;
      words(plot.y.title, { x: 36, y: middle, "text-anchor": "middle", "font-size": 26, transform: `rotate(270, 36, ${middle})` });
      const clipped = draw("g", { "clip-path": `url(#${clip})`, fill: "none" }, overlay);
      plot.curves.forEach((curve, index) => {
        const stroke = lines[index].querySelector("[stroke]")?.getAttribute("stroke");
        if (!stroke || hidden.has(curve.series)) return;
        const line = draw("polyline", { points: pathOf(curve.points), stroke, "stroke-width": 4 }, clipped);
        if (curve.dashed) line.setAttribute("stroke-dasharray", "14 10");
      });
      for (const line of fronts.flatMap((front) => [...front.querySelectorAll("polyline")])) {
        const joined = [...line.points].map((at) => [at.x, at.y]);
        draw("polyline", { points: pathOf(joined), stroke: ink, "stroke-width": 2 }, clipped);
      }
    };
    const showWhole = () => {
      if (view === whole) return;
      view = whole;
      redraw();
    };
    // Nearer or farther, about the chosen point, which stays chosen.
    const zoom = (factor) => {
      const point = current;
      const about = point ? point.at : [(view[0] + view[2]) / 2, (view[1] + view[3]) / 2];
      const along = (k, low, high) => {
        const size = Math.min(high - low, (view[k + 2] - view[k]) / factor);
        if (size === high - low) return [low, high];
        const start = Math.min(high - size, Math.max(low, about[k] - size / 2));
        return [start, start + size];
      };
      const [[x0, x1], [y0, y1]] = [along(0, left, right), along(1, top, bottom)];
      if (x1 - x0 < (right - left) / MOST_ENLARGED) return;
      view = x1 - x0 < right - left || y1 - y0 < bottom - top ? [x0, y0, x1, y1] : whole;
      redraw();
      if (point) tell(point);
    };
    // For fingers, and for whoever does not know the keys.
    const button = (text, name, act) => {
      const element = document.createElement("button");
      element.type = "button";
      element.textContent = text;
      element.setAttribute("aria-label", name);
      element.addEventListener("click", act);
      return element;
    };
    const reset = button("whole", "whole plot", () => {
      showWhole();
      svg.focus();
    });
    reset.className = "whole";
    reset.hidden = true;
    const tools = document.createElement("div");
    tools.className = "tools";
    tools.append(reset, button("−", "show more", () => zoom(0.5)), button("+", "enlarge", () => zoom(2)));
    figure.append(tools);

    // Pointer: values, and an area dragged with the mouse. Touch scrolls the page as ever.
    const local = (event) => {
      const box = svg.getBoundingClientRect();
      const scale = svg.viewBox.baseVal.width / box.width;
      const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
      return [clamp((event.clientX - box.left) * scale, left, right), clamp((event.clientY - box.top) * scale, top, bottom)];
    };
    let from = null;
    svg.addEventListener("pointerdown", (event) => {
      if (event.target.closest("g.legend")) return;
      if (event.pointerType !== "mouse") {
        const point = nearest(event, 28);
        if (point) tell(point);
        else forget();
      } else if (event.button === 0) {
        from = local(event);
        svg.setPointerCapture(event.pointerId);
        event.preventDefault();
        svg.focus({ preventScroll: true });
      }
    });
    svg.addEventListener("pointermove", (event) => {
      if (event.pointerType !== "mouse") return;
      if (from === null) {
        const point = nearest(event, 16);
        if (point && point !== current) tell(point);
        else if (!point && current) forget();
        return;
      }
      const to = local(event);
      const [x, y] = [Math.min(from[0], to[0]), Math.min(from[1], to[1])];
      const [width, height] = [Math.abs(from[0] - to[0]), Math.abs(from[1] - to[1])];
      for (const [name, value] of Object.entries({ x, y, width, height, visibility: "visible" })) {
        frame.setAttribute(name, value);
      }
    });
    svg.addEventListener("pointerup", (event) => {
      if (from === null) return;
      const to = local(event);
      const start = from;
      from = null;
      frame.setAttribute("visibility", "hidden");
      if (Math.abs(start[0] - to[0]) < 20 || Math.abs(start[1] - to[1]) < 20) return;
      const back = ([x, y]) => [
        view[0] + ((x - left) / (right - left)) * (view[2] - view[0]),
        view[1] + ((y - top) / (bottom - top)) * (view[3] - view[1]),
      ];
      const [a, b] = [back(start), back(to)];
      view = [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[0], b[0]), Math.max(a[1], b[1])];
      redraw();
    });
    const drop = () => {
      from = null;
      frame.setAttribute("visibility", "hidden");
    };
    svg.addEventListener("pointercancel", drop);
    svg.addEventListener("pointerleave", (event) => {
      if (event.pointerType === "mouse" && document.activeElement !== svg) forget();
    });
    svg.addEventListener("dblclick", showWhole);

    // Keyboard: left and right along a series, up and down from series to series.
    const step = (key) => {
      const all = seen();
      if (!all.length) return;
      if (!all.includes(current)) return tell(all[0]);
      const forward = key === "ArrowRight" || key === "ArrowDown" ? 1 : -1;
      if (key === "ArrowLeft" || key === "ArrowRight") {
        const own = all.filter((point) => point.curve === current.curve);
        own.sort((a, b) => a.at[0] - b.at[0]);
        return tell(own[(own.indexOf(current) + forward + own.length) % own.length]);
      }
      const curves = [...new Set(all.map((point) => point.curve))];
      const next = curves[(curves.indexOf(current.curve) + forward + curves.length) % curves.length];
      const close = (point) => Math.abs(point.at[0] - current.at[0]);
      tell(all.filter((point) => point.curve === next).reduce((a, b) => (close(b) < close(a) ? b : a)));
    };
    svg.addEventListener("focus", () => {
      if (svg.matches(":focus-visible") && !current) step("ArrowRight");
    });
    svg.addEventListener("blur", forget);
    svg.addEventListener("keydown", (event) => {
      if (event.key === "Escape") {
        drop();
        forget();
        showWhole();
      } else if (event.target === svg && event.key.startsWith("Arrow")) {
        event.preventDefault();
        step(event.key);
      } else if (event.target === svg && "+=-0".includes(event.key) && !event.ctrlKey && !event.metaKey) {
        event.preventDefault();
        if (event.key === "0") showWhole();
        else zoom(event.key === "-" ? 0.5 : 2);
      }
    });

    return (series) => {
      if (!hidden.delete(series)) hidden.add(series);
      redraw();
      return hidden.has(series);
    };
  };

  const prepare = (figure) => {
    const data = figure.querySelector("script");
    const svg = figure.querySelector("svg");
    if (!data || !svg) return;
    svg.setAttribute("role", "group");
    svg.setAttribute("aria-description", "Arrow keys go from point to point, plus and minus enlarge, Escape shows the whole plot.");
    svg.setAttribute("tabindex", "0");
    // Most plots of a page are never touched.
    let toggle = null;
    const wake = () => {
      if (!toggle) toggle = enliven(figure, svg, JSON.parse(data.textContent));
      return toggle;
    };
    for (const type of ["pointerenter", "pointerdown", "focusin"]) {
      svg.addEventListener(type, wake, { capture: true });
    }
    const rows = [...svg.querySelectorAll("g.legend")];
    // One stop of the tab key for the whole legend.
    rows.forEach((row, index) => {
      const name = row.querySelector("text").textContent.trim();
      for (const [key, value] of Object.entries({ role: "button", tabindex: index ? -1 : 0, "aria-pressed": "true", "aria-label": `show ${name}` })) {
        row.setAttribute(key, value);
      }
    });
    const press = (row) => {
      const isHidden = wake()(row.dataset.series);
      for (const other of rows) {
        if (other.dataset.series === row.dataset.series) other.setAttribute("aria-pressed", String(!isHidden));
      }
    };
    svg.addEventListener("click", (event) => {
      const row = event.target.closest("g.legend");
      if (row) press(row);
    });
    svg.addEventListener("keydown", (event) => {
      const row = event.target.closest("g.legend");
      if (!row) return;
      const move = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (event.key === "Enter" || event.key === " ") press(row);
      else if (move) rows[(rows.indexOf(row) + move + rows.length) % rows.length].focus();
      else return;
      event.preventDefault();
    });
  };
  page.enlivenPlots = (root) => root.querySelectorAll(".plots figure").forEach(prepare);
  page.enlivenPlots(document);
  window.addEventListener("scroll", () => (tip.hidden = true), { passive: true, capture: true });
})();
