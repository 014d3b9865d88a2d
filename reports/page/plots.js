// Plots by Observable Plot, with additions: series to hide, areas to enlarge, and points
// that the keyboard reaches.
const plotsOf = (figures) => make("div", { class: "plots" }, ...figures.map(plotOf));

const plotOf = (figure) => {
  const [WIDTH, HEIGHT, REACH] = [640, 400, 20];
  const hidden = new Set();
  // Everything is drawn as laid out, logarithms where the axis is one: a zoom is linear then.
  const lay = (axis, value) => (figure[axis].scale === "log" ? Math.log(value) : value);
  const unlay = (axis, value) => (figure[axis].scale === "log" ? Math.exp(value) : value);
  const laid = ([x, y], more) => ({ u: lay("x", x), v: lay("y", y), x, y, ...more });
  const points = figure.curves.flatMap((curve) => curve.points.map(([x, y, n, spheres, bar]) =>
    laid([x, y], { n, spheres, bar, curve })).filter(({ u, v }) => Number.isFinite(u) && Number.isFinite(v)));
  const lines = figure.curves.flatMap((curve) => curve.points.map((at) => laid(at, { curve })));

  // A linear axis begins at zero, a logarithmic one spans at least a factor of two, or a single value
  // would have no scale.
  const range = (axis, key) => {
    const ends = key === "v" ? points.flatMap(({ bar }) => (bar ?? []).map((end) => lay(axis, end))) : [];
    const [low, high] = d3.extent([...points.map((point) => point[key]), ...ends]);
    if (figure[axis].scale !== "log") return [Math.min(0, low), Math.max(1.05 * high, 1e-12)];
    const widen = 0.11 + 0.5 * Math.max(0, Math.LN2 - (high - low));
    return [low - widen, high + widen];
  };
  const whole = { u: range("x", "u"), v: range("y", "v") };
  let [view, current, chart] = [whole, null, null];
  const isInside = (point) => !hidden.has(point.curve.series) &&
    ["u", "v"].every((key) => point[key] >= view[key][0] - 1e-9 && point[key] <= view[key][1] + 1e-9);
  // Round numbers; of many decades the decades alone, of a part of one the usual steps.
  const axisOf = (axis, key) => {
    const [low, high] = view[key].map((end) => unlay(axis, end));
    const digits = high > 1000 * low ? [1] : [1, 2, 5];
    const decades = d3.range(Math.floor(Math.log10(low)), Math.log10(high)).flatMap((e) => digits.map((d) => d * 10 ** e));
    const round = figure[axis].scale === "log" ? decades.filter((value) => value >= low && value <= high) : [];
    return {
      domain: view[key], grid: true, label: figure[axis].title, labelArrow: "none", labelAnchor: "center",
      ticks: (round.length > 2 ? round : d3.ticks(low, high, 6)).map((value) => lay(axis, value)),
      tickFormat: (at) => unlay(axis, at).toLocaleString("en", { maximumSignificantDigits: 3 }),
    };
  };
  // The front: points that no visible one beats in both directions. Means over fewer meshes than the others are not
  // among them.
  const front = () => {
    const most = d3.max(points, ({ n }) => n);
    const inOrder = points.filter(({ n, curve }) => n === most && !hidden.has(curve.series))
      .sort((a, b) => a.u - b.u || a.v - b.v);
    const isBetter = (a, b) => (figure.higher ? a.v > b.v : a.v < b.v);
    return inOrder.reduce((best, point) => (best.length && !isBetter(point, best.at(-1)) ? best : [...best, point]), []);
  };
  // Numbers of spheres at points, where no axis has them, that cover no other one.
  const apart = (tagged) => {
    const share = (tag, key) => (tag[key] - view[key][0]) / (view[key][1] - view[key][0]);
    return tagged.filter(({ spheres }) => spheres !== null).filter(isInside).reduce((visible, tag) => (visible.some((other) =>
      Math.abs(share(tag, "u") - share(other, "u")) < 0.07 && Math.abs(share(tag, "v") - share(other, "v")) < 0.04)
      ? visible : [...visible, tag]), []);
  };
  const tags = (tagged, name) => Plot.text(apart(tagged), {
    x: "u", y: "v", text: ({ spheres }) => Math.round(spheres).toLocaleString("en"), dx: 7, dy: -7, textAnchor: "start",
    fontSize: 11, fontWeight: 600, stroke: "var(--card)", fill: "currentColor", className: `tags ${name}`,
  });
  // Those of one curve at a time, or of the front.
  const showTags = (point) => {
    const shown = point ? `curve-${figure.curves.indexOf(point.curve)}` : "front";
    for (const group of chart.querySelectorAll(".tags")) group.style.display = group.classList.contains(shown) ? "" : "none";
  };

  const words = ({ x, y, n, spheres, bar, curve }) => {
    const format = (value) => value.toLocaleString("en", { maximumSignificantDigits: 4 });
    const of = n === null ? "" : `n = ${counted(n, "mesh", "meshes")}`;
    return [curve.name, [curve.of, of].filter(Boolean).join(", "), `${figure.x.title}: ${format(x)}`,
      `${figure.y.title}: ${format(y)}`, spheres === null ? "" : `spheres: ${format(spheres)}`,
      bar ? `${n === 1 ? "range over seeds" : "95 % interval over meshes"}: ${bar.map(format).join(" to ")}` : ""].filter(Boolean).join("\n");
  };

  const box = make("figure", { class: "plot" });
  const announcement = make("output", { class: "unseen" });
  const colour = ({ curve }) => report.series[curve.series].colour;
  const draw = () => {
    const seen = points.filter(isInside);
    const shown = ({ curve }) => !hidden.has(curve.series);
    const common = { x: "u", y: "v", clip: true };
    const barred = seen.filter((point) => point.bar);
    const hollow = ({ curve }) => (report.series[curve.series].hollow ? "var(--card)" : colour({ curve }));
    const symbol = ({ curve }) => report.series[curve.series].symbol;
    const tip = { x: "u", y: "v", title: words, fill: "var(--card)", stroke: "var(--dim)", fontSize: 13 };
    const solid = lines.filter((point) => shown(point) && !point.curve.dashed);
    const dashed = lines.filter((point) => shown(point) && point.curve.dashed);
    const z = ({ curve }) => figure.curves.indexOf(curve);
    const chosen = current && seen.includes(current) ? [current] : [];
    const svg = Plot.plot({
      width: WIDTH, height: HEIGHT, marginLeft: 62, marginBottom: 46, className: "chart",
      style: { fontSize: "13px", background: "none", overflow: "visible" },
      x: axisOf("x", "u"), y: axisOf("y", "v"), color: { type: "identity" },
      marks: [
        Plot.frame({ stroke: "var(--rule)" }),
        Plot.line(front(), { x: "u", y: "v", curve: "step-after", clip: true, stroke: "var(--dim)", strokeOpacity: 0.3, strokeWidth: 7 }),
        Plot.line(solid, { ...common, z, stroke: colour, strokeWidth: 2 }),
        Plot.ruleX(barred, { x: "u", y1: ({ bar }) => lay("y", bar[0]), y2: ({ bar }) => lay("y", bar[1]), stroke: colour, strokeOpacity: 0.5, clip: true }),
        Plot.line(dashed, { ...common, z, stroke: colour, strokeWidth: 2, strokeDasharray: "7 5" }),
        Plot.dot(seen, { ...common, symbol, stroke: colour, fill: hollow, r: 4, clip: false }),
        tags(front(), "front"),
        ...figure.curves.map((curve, k) => tags(points.filter((point) => point.curve === curve), `curve-${k}`)),
        Plot.dot(chosen, { x: "u", y: "v", r: 9, stroke: "currentColor", strokeWidth: 2 }),
        Plot.tip(chosen, tip),
        Plot.tip(seen, Plot.pointer({ ...tip, maxRadius: REACH })),
      ],
    });
    svg.setAttribute("class", `chart ${svg.getAttribute("class")}`);
    svg.setAttribute("role", "group");
    svg.setAttribute("tabindex", "0");
    svg.setAttribute("aria-label", figure.title);
    svg.setAttribute("aria-description", "Arrow keys go from point to point, plus and minus enlarge, Escape shows the whole plot.");
    const hadFocus = document.activeElement === chart;
    if (chart) chart.replaceWith(svg);
    chart = svg;
    chart.addEventListener("input", () => showTags(chart.value ?? current));
    showTags(current);
    reset.hidden = view === whole;
    announcement.textContent = chosen.length ? words(current) : "";
    if (hadFocus) svg.focus({ preventScroll: true });
    return svg;
  };
  const tell = (point) => {
    current = point;
    draw();
  };

  // Nearer or farther, about the chosen point.
  const zoom = (factor) => {
    const along = (key) => {
      const [[low, high], [from, to]] = [whole[key], view[key]];
      const about = current ? current[key] : (from + to) / 2;
      const size = Math.min(high - low, (to - from) / factor);
      const start = Math.min(high - size, Math.max(low, about - size / 2));
      return [start, start + size];
    };
    const next = { u: along("u"), v: along("v") };
    const share = (next.u[1] - next.u[0]) / (whole.u[1] - whole.u[0]);
    if (share < 1 / 200) return;
    view = share > 1 - 1e-9 ? whole : next;
    draw();
  };
  const showWhole = () => {
    view = whole;
    draw();
  };
  const button = (text, name, act) => {
    const element = make("button", { type: "button", "aria-label": name }, text);
    element.addEventListener("click", act);
    return element;
  };
  const reset = button("whole", "whole plot", () => {
    showWhole();
    chart.focus();
  });
  reset.className = "whole";

  // An area dragged with the mouse. Touch scrolls the page as ever.
  const local = (event) => {
    const frame = chart.getBoundingClientRect();
    return [((event.clientX - frame.left) * WIDTH) / frame.width, ((event.clientY - frame.top) * HEIGHT) / frame.height];
  };
  let [from, area] = [null, null];
  const drop = () => {
    area?.remove();
    [from, area] = [null, null];
  };
  const stage = make("div", { class: "stage" });
  // Captured: a press on a point pins its tip, and stops there.
  stage.addEventListener("pointerdown", (event) => {
    if (event.pointerType !== "mouse" || event.button !== 0) return;
    event.preventDefault();
    chart.focus({ preventScroll: true });
    from = local(event);
    area = d3.select(chart).append("rect").attr("class", "area").node();
  }, { capture: true });
  stage.addEventListener("pointermove", (event) => {
    if (!from) return;
    const to = local(event);
    d3.select(area).attr("x", Math.min(from[0], to[0])).attr("y", Math.min(from[1], to[1]))
      .attr("width", Math.abs(from[0] - to[0])).attr("height", Math.abs(from[1] - to[1]));
  });
  stage.addEventListener("pointerup", (event) => {
    if (!from) return;
    const [a, b] = [from, local(event)];
    drop();
    if (Math.abs(a[0] - b[0]) < 10 || Math.abs(a[1] - b[1]) < 10) return;
    const along = (key, axis, k) => {
      const ends = [a[k], b[k]].map((at) => chart.scale(axis).invert(at));
      return [Math.max(whole[key][0], Math.min(...ends)), Math.min(whole[key][1], Math.max(...ends))];
    };
    view = { u: along("u", "x", 0), v: along("v", "y", 1) };
    draw();
  });
  stage.addEventListener("pointercancel", drop);
  stage.addEventListener("pointerleave", drop);
  stage.addEventListener("dblclick", showWhole);

  // Left and right along a series, up and down from series to series.
  const step = (key) => {
    const seen = points.filter(isInside);
    if (!seen.length) return;
    if (!seen.includes(current)) {
      tell(seen[0]);
      return;
    }
    const forward = key === "ArrowRight" || key === "ArrowDown" ? 1 : -1;
    if (key === "ArrowLeft" || key === "ArrowRight") {
      const own = seen.filter((point) => point.curve === current.curve).sort((a, b) => a.x - b.x);
      tell(own[(own.indexOf(current) + forward + own.length) % own.length]);
      return;
    }
    const curves = [...new Set(seen.map((point) => point.curve))];
    const next = curves[(curves.indexOf(current.curve) + forward + curves.length) % curves.length];
    tell(d3.least(seen.filter((point) => point.curve === next), (point) => Math.abs(point.u - current.u)));
  };
  stage.addEventListener("keydown", (event) => {
    if (event.key.startsWith("Arrow")) step(event.key);
    else if (event.key === "Escape") {
      drop();
      current = null;
      showWhole();
    } else if (event.key === "0") showWhole();
    else if ("+=-".includes(event.key) && !event.ctrlKey && !event.metaKey) zoom(event.key === "-" ? 0.5 : 2);
    else return;
    event.preventDefault();
  });

  const legend = make("div", { class: "legend" });
  for (const curve of figure.curves.filter((each) => each.label)) {
    const { symbol, hollow, colour: ink } = report.series[curve.series];
    const shape = d3.symbol(d3[`symbol${symbol[0].toUpperCase()}${symbol.slice(1)}`], 55)();
    const mark = d3.create("svg").attr("viewBox", "-8 -8 16 16").attr("aria-hidden", "true");
    mark.append("path").attr("d", shape).attr("stroke", ink).attr("fill", hollow ? "none" : ink);
    const row = make("button", { type: "button", "aria-pressed": "true" }, mark.node(), curve.label);
    row.addEventListener("click", () => {
      if (!hidden.delete(curve.series)) hidden.add(curve.series);
      row.setAttribute("aria-pressed", String(!hidden.has(curve.series)));
      draw();
    });
    legend.append(row);
  }
  const band = make("span", { class: "band" });
  const numbers = points.some(({ spheres }) => spheres !== null) ? ", with its numbers of spheres" : "";
  legend.append(make("span", { class: "front-note" }, band, `front: no other point is better in both${numbers}`));
  const tools = make("div", { class: "tools" }, reset, button("−", "show more", () => zoom(0.5)), button("+", "enlarge", () => zoom(2)));
  stage.append(draw());
  box.append(make("figcaption", {}, figure.title, tools), stage, legend, announcement);
  return box;
};
