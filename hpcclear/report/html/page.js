"use strict";
/* The interactive parts of a report: front, responses, moving mechanism. Text from files only ever enters as
   textContent or attribute values of SVG elements, never as markup. */
(() => {
  const content = JSON.parse(document.getElementById("content").textContent);
  const SVG = "http://www.w3.org/2000/svg";
  const byId = (id) => document.getElementById(id);
  const called = (name) => name === "original" ? "baseline" : name === content.front.recommended ? `${content.front.role} (${name})` : name;

  function set(element, attributes) {
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  }

  function append(parent, element, attributes, text) {
    set(element, attributes);
    if (text !== null) element.textContent = text;
    parent.append(element);
    return element;
  }

  const draw = (parent, name, attributes = {}, text = null) => append(parent, document.createElementNS(SVG, name), attributes, text);
  const put = (parent, name, text = null, attributes = {}) => append(parent, document.createElement(name), attributes, text);

  function ticks(low, high, count) {
    const raw = (high - low) / count || 1;
    const size = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * size).find((s) => s >= raw * 0.999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
      found.push(Number((k * step).toPrecision(12)));
    }
    return found;
  }

  function extent(values, margin) {
    let low = Math.min(...values), high = Math.max(...values);
    const pad = (high - low || Math.abs(high) || 1) * margin;
    return [low - pad, high + pad];
  }

  function axes(svg, box, xs, ys, xLabel, yLabel, counts = [6, 6]) {
    const x = (v) => box.left + ((v - xs[0]) / (xs[1] - xs[0])) * box.width;
    const y = (v) => box.top + box.height - ((v - ys[0]) / (ys[1] - ys[0])) * box.height;
    const bottom = box.top + box.height;
    for (const v of ticks(ys[0], ys[1], counts[1])) {
      draw(svg, "line", { x1: box.left, x2: box.left + box.width, y1: y(v), y2: y(v), class: "rule" });
      draw(svg, "text", { x: box.left - 6, y: y(v) + 4, "text-anchor": "end" }, String(v).replace("-", "−"));
    }
    for (const v of ticks(xs[0], xs[1], counts[0])) {
      draw(svg, "line", { x1: x(v), x2: x(v), y1: bottom, y2: bottom + 4, class: "axis" });
      draw(svg, "text", { x: x(v), y: bottom + 18, "text-anchor": "middle" }, String(v).replace("-", "−"));
    }
    draw(svg, "line", { x1: box.left, x2: box.left + box.width, y1: bottom, y2: bottom, class: "axis" });
    draw(svg, "line", { x1: box.left, x2: box.left, y1: box.top, y2: bottom, class: "axis" });
    draw(svg, "text", { x: box.left + box.width / 2, y: bottom + 36, "text-anchor": "middle" }, xLabel);
    draw(svg, "text", { x: box.left - 6, y: box.top - 10, "text-anchor": "start" }, yLabel);
    return [x, y];
  }

  /* ---- the front ---- */

  const colour = (name) => `var(--c${Math.max(0, content.front.cases.indexOf(name)) % 4})`;

  function marker(svg, point, x, y) {
    const size = 7;
    const shared = { class: "point hollow", style: `--own: ${colour(point.case)}` };
    if (point.kind === "original") {
      return draw(svg, "rect", { x: x - size, y: y - size, width: 2 * size, height: 2 * size, ...shared });
    }
    if (point.kind === "printed") {
      const d = `M${x},${y - size * 1.3}L${x + size * 1.3},${y}L${x},${y + size * 1.3}L${x - size * 1.3},${y}Z`;
      return draw(svg, "path", { d, ...shared });
    }
    return draw(svg, "circle", { cx: x, cy: y, r: size, ...shared });
  }

  function list(panel, title, rows) {
    if (!rows.length) return;
    put(panel, "h3", title);
    const entries = put(panel, "dl");
    for (const [name, value] of rows) {
      put(entries, "dt", name);
      put(entries, "dd", value);
    }
  }

  function describe(panel, point) {
    panel.replaceChildren();
    put(panel, "h3", point.case && !point.name.startsWith(point.case) ? `${point.case}: ${point.name}` : called(point.name));
    list(panel, "Design", point.design);
    list(panel, "By the surrogate", point.surrogate);
  }

  function chart(panel, one, base) {
    const width = Math.max(260, Math.min(640, panel.clientWidth / (panel.clientWidth > 850 ? 2 : 1)));
    const height = 160;
    const svg = draw(panel, "svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${one.label} over two revolutions` });
    const all = base ? one.y.concat(base.y) : one.y;
    const big = Math.max(...all.map(Math.abs));
    const kilo = big >= 2000;
    const values = (y) => y.map((v) => (kilo ? v / 1000 : v));
    const box = { left: 48, top: 26, width: width - 56, height: height - 66 };
    const label = `${one.label} (${kilo ? "k" : ""}${one.unit.replace("^2", "²")})`;
    const [x, y] = axes(svg, box, extent(one.x, 0), extent(values(all), 0.03), "crank angle (revolutions)", label, [4, 4]);
    const path = (c) => values(c.y).map((v, k) => `${k ? "L" : "M"}${x(c.x[k]).toFixed(1)},${y(v).toFixed(1)}`).join("");
    if (base) draw(svg, "path", { d: path(base), class: "curve before" });
    draw(svg, "path", { d: path(one), class: "curve after" });
  }

  function detail(panel, point) {
    const below = byId("front-responses");
    below.replaceChildren();
    describe(panel, point);
    list(panel, "By simulation, with 95 % confidence intervals", point.direct);
    const one = content.responses[point.response];
    const base = point.response === "original" ? null : content.responses.original;
    if (one) {
      put(below, "h3", `Responses of ${called(point.name)}${base ? " (grey: the baseline design)" : ""}`);
      const charts = put(below, "div", null, { class: "charts" });
      one.forEach((curve, k) => chart(charts, curve, base ? base[k] : null));
    } else {
      put(panel, "p", "No response was stored for this design.", { class: "soft" });
    }
  }

  function front() {
    const place = byId("front");
    if (!place || !content.front.points.length) return;
    const view = byId("front-view");
    const far = (p) => p.kind === "printed" || p.kind === "original";
    const known = (p) => Number.isFinite(p.x) && Number.isFinite(p.y);
    const shown = () => content.front.points.filter((p) => known(p) && (view.value === "all" || !far(p)));
    const redraw = () => { build(place, shown()); legend(byId("front-legend"), new Set(shown().map((p) => p.kind))); };
    view.addEventListener("change", redraw);
    if (!shown().length) view.value = "all";
    directions(view.closest(".controls"), redraw);
    redraw();
  }

  const along = [0, 1]; /* which axes lie across and up */

  function bars(svg, p, x, y) {
    if (!p.intervals) return;
    const [across, up] = along.map((k) => p.intervals[k]);
    const style = `--own: ${colour(p.case)}`, fixed = { class: "bar", style };
    if (across) draw(svg, "line", { x1: x(across[0]), x2: x(across[1]), y1: y(p.y), y2: y(p.y), ...fixed });
    if (up) draw(svg, "line", { x1: x(p.x), x2: x(p.x), y1: y(up[0]), y2: y(up[1]), ...fixed });
  }

  /* where a case has other objectives than mean and deviation, any two may be looked at */
  function directions(controls, redraw) {
    const { axes, points } = content.front;
    if (!axes) return;
    for (const [at, key, words] of [[0, "x", "across"], [1, "y", "up"]]) {
      const select = put(put(controls, "label", words), "select");
      axes.forEach((axis, k) => put(select, "option", axis, { value: k }));
      select.value = at;
      select.addEventListener("change", () => {
        content.front[key] = axes[select.value];
        along[at] = Number(select.value);
        for (const p of points) p[key] = p.at[select.value];
        points.sort((a, b) => a.x - b.x || a.y - b.y);
        redraw();
      });
    }
  }

  function build(place, points) {
    place.replaceChildren();
    if (!points.length) return;
    const panel = byId("front-panel");
    /* as wide as there is room for, so that type keeps its size on a phone */
    const width = Math.max(300, Math.min(640, place.clientWidth)), height = Math.max(320, 0.72 * width);
    const label = "Pareto front: arrow keys move between designs, Enter shows one";
    const svg = draw(place, "svg", { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": label });
    const box = { left: 52, top: 34, width: width - 66, height: height - 84 };
    const reach = (axis, key) => points.flatMap((p) => [p[key], ...((p.intervals && p.intervals[along[axis]]) || [])]);
    const xs = extent(reach(0, "x"), 0.05), ys = extent(reach(1, "y"), 0.05);
    const [x, y] = axes(svg, box, xs, ys, content.front.x, content.front.y, [width < 450 ? 3 : 6, 6]);
    const marks = [];
    for (const [k, p] of points.entries()) {
      bars(svg, p, x, y);
      const mark = marker(svg, p, x(p.x), y(p.y));
      const words = `${p.case} ${p.name}: ${content.front.x} ${p.x}, ${content.front.y} ${p.y}`;
      set(mark, { tabindex: "-1", role: "button", "aria-label": words, "data-index": k });
      marks[k] = mark;
      mark.addEventListener("mouseenter", () => describe(panel, p));
      mark.addEventListener("mouseleave", () => detail(panel, points[chosen]));
      mark.addEventListener("focus", () => move(k, false));
      mark.addEventListener("click", () => { choose(k); more.open = true; });
    }
    const halo = draw(svg, "circle", { r: 13, class: "halo" });
    let here = 0, chosen = 0;
    function move(k, focus = true) {
      marks[here].setAttribute("tabindex", "-1");
      here = Math.max(0, Math.min(points.length - 1, k));
      marks[here].setAttribute("tabindex", "0");
      if (focus) marks[here].focus();
    }
    function choose(k) {
      marks[chosen].classList.remove("selected");
      marks[chosen].removeAttribute("aria-pressed");
      chosen = k;
      marks[k].classList.add("selected");
      set(halo, { cx: x(points[k].x), cy: y(points[k].y) });
      marks[k].setAttribute("aria-pressed", "true");
      move(k, false);
      detail(panel, points[k]);
    }
    const more = byId("front-more");
    more.ontoggle = () => { if (more.open) detail(panel, points[chosen]); };  /* charts are as wide as there is room for */
    svg.addEventListener("keydown", (event) => {
      const keys = {
        ArrowRight: () => move(here + 1), ArrowLeft: () => move(here - 1),
        ArrowUp: () => move(here - 1), ArrowDown: () => move(here + 1),
        Home: () => move(0), End: () => move(points.length - 1),
        Enter: () => { choose(here); more.open = true; }, " ": () => choose(here),
      };
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
    const best = points.findIndex((p) => p.name === content.front.recommended);
    const first = best >= 0 ? best : points.findIndex((p) => content.responses[p.response] && p.kind === "design");
    choose(Math.max(0, first));
  }

  function legend(place, kinds) {
    place.replaceChildren();
    const entry = (point, words) => {
      const item = put(place, "span");
      const svg = draw(item, "svg", { viewBox: "0 0 24 24", "aria-hidden": "true" });
      marker(svg, point, 12, 12);
      item.append(` ${words}`);
    };
    for (const name of content.front.cases) if (name) entry({ kind: "design", case: name }, name);
    for (const [kind, words] of Object.entries(content.front.legend)) {
      if (kinds.has(kind) && (kind !== "design" || !content.front.cases[0])) entry({ kind, case: content.front.cases[0] }, words);
    }
  }

  /* ---- the mechanism ---- */

  function mechanism() {
    const place = byId("mechanism"), names = Object.keys(content.motions);
    if (!place || !names.length) return;
    const select = byId("motion-name"), button = byId("motion-play"), gain = byId("motion-gain");
    const at = byId("motion-at"), out = byId("motion-text"), speed = byId("motion-speed");
    for (const name of names) put(select, "option", called(name), { value: name });
    const svg = draw(place, "svg", { role: "img", "aria-label": "The mechanism, its clearances drawn larger than they are" });
    let shapes = {}, motion = null, frame = 0, playing = false, last = 0, strongest = 1, l = 1;
    const add = (name, kind, attributes) => { shapes[name] = draw(svg, kind, attributes); };

    function load(name) {
      motion = content.motions[name];
      const x = motion.points.flatMap((row) => row.filter((_, k) => k % 2 === 0));
      const y = motion.points.flatMap((row) => row.filter((_, k) => k % 2 === 1));
      const box = [Math.min(...x), -Math.max(...y), Math.max(...x), -Math.min(...y)];
      l = 0.3 * Math.max(box[2] - box[0], box[3] - box[1]);
      strongest = Math.max(1e-9, ...motion.force.flat());
      svg.setAttribute("viewBox", `${box[0] - 0.5 * l} ${box[1] - 0.5 * l} ${box[2] - box[0] + l} ${box[3] - box[1] + l}`);
      svg.replaceChildren();
      shapes = {};
      const thin = `${0.02 * l}`, thick = `${0.09 * l}`;
      motion.still.forEach((still, k) => {
        if (still) add(`hub${k}`, "circle", { cx: motion.points[0][2 * k], cy: -motion.points[0][2 * k + 1], r: 0.12 * l, fill: "var(--soft)" });
      });
      motion.bodies.forEach((points, b) => {
        if (points.length === 1) add(`body${b}`, "rect", { width: 0.7 * l, height: 0.5 * l, x: -0.35 * l, y: -0.25 * l, fill: "var(--line)", stroke: motion.changed.includes(b) ? "var(--c1)" : "var(--soft)", "stroke-width": thin });
        else add(`body${b}`, "polygon", { fill: points.length > 2 ? "var(--line)" : "none", "fill-opacity": 0.5, stroke: motion.changed.includes(b) ? "var(--c1)" : `var(--c${2 * (b % 2)})`, "stroke-width": thick, "stroke-linejoin": "round", "stroke-opacity": 0.8 });
      });
      motion.pairs.forEach((_, j) => {
        add(`ring${j}`, "circle", { fill: "none", stroke: "var(--c2)", "stroke-width": `${0.035 * l}` });
        add(`pin${j}`, "circle", { r: 0.05 * l, fill: "var(--ink)" });
        add(`force${j}`, "line", { stroke: "var(--c3)", "stroke-width": `${0.05 * l}`, "stroke-linecap": "round" });
      });
      const widest = Math.max(...motion.clearance, 1e-9);
      gain.max = Math.max(2, Math.round((0.6 * l) / widest));
      gain.value = Math.min(gain.max, Math.max(1, Math.round((0.16 * l) / widest)));
      at.max = motion.turn.length - 1;
      show(Math.min(frame, motion.turn.length - 1));
    }

    function show(k) {
      frame = Math.floor(k);
      const g = Number(gain.value), e = motion.e[frame], row = motion.points[frame];
      const place = (p) => [row[2 * p], -row[2 * p + 1]];
      /* journals stay where they are, bearings move away from them by the enlarged eccentricity */
      const moved = new Map(motion.pairs.map(([journal, bearing], j) => {
        const [x, y] = place(journal);
        return [bearing, [x - g * e[2 * j], y + g * e[2 * j + 1]]];
      }));
      motion.bodies.forEach((points, b) => {
        const corners = points.map((p) => moved.get(p) || place(p));
        if (points.length === 1) set(shapes[`body${b}`], { transform: `translate(${corners[0].join(" ")}) rotate(${(-180 * motion.angles[frame][b]) / Math.PI})` });
        else set(shapes[`body${b}`], { points: corners.map((c) => c.join(",")).join(" ") });
      });
      motion.pairs.forEach(([journal, bearing], j) => {
        const size = (0.6 * l * motion.force[frame][j]) / strongest, length = Math.hypot(e[2 * j], e[2 * j + 1]) || 1;
        const [x, y] = place(journal), [cx, cy] = moved.get(bearing);
        set(shapes[`ring${j}`], { cx, cy, r: Math.max(g * motion.clearance[j], 0.03 * l) });
        set(shapes[`pin${j}`], { cx: x, cy: y });
        set(shapes[`force${j}`], {
          x1: x, y1: y, x2: x + (size * e[2 * j]) / length, y2: y - (size * e[2 * j + 1]) / length,
          visibility: size > 0 ? "visible" : "hidden",
        });
      });
      at.value = frame;
      const angle = Math.round((motion.turn[frame] % 1) * 360) % 360;
      const force = motion.force[frame].map((f, j) => `${motion.joints[j]} ${f > 0 ? `${(f / 1000).toFixed(2)} kN` : "free flight"}`);
      out.textContent = `crank ${String(angle).padStart(3, "\u2007")}°, ${force.join(", ")}, clearance × ${g}`;
      at.setAttribute("aria-valuetext", `crank ${angle} degrees`);
    }

    function step(now) {
      if (!playing) return;
      const rate = (motion.turn.length / (motion.turn[motion.turn.length - 1] - motion.turn[0] || 1)) * Number(speed.value);
      const next = frame + Math.max(1, Math.round(((now - last) / 1000) * rate));
      if (now - last > 30) {
        show(next >= motion.turn.length ? 0 : next);
        last = now;
      }
      requestAnimationFrame(step);
    }
    function play(on) {
      playing = on;
      button.textContent = on ? "Pause" : "Play";
      last = performance.now();
      if (on) requestAnimationFrame(step);
    }
    button.addEventListener("click", () => play(!playing));
    select.addEventListener("change", () => load(select.value));
    gain.addEventListener("input", () => show(frame));
    at.addEventListener("input", () => { play(false); show(Number(at.value)); });
    const recommended = content.front.recommended;
    select.value = names.includes(recommended) ? recommended : names[0];
    load(select.value);
    play(!window.matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  /* a figure that is its page's target fills the screen; the way back stands in it, Escape takes it */
  const opened = () => {  /* a link into a fold opens it */
    const at = location.hash && document.getElementById(location.hash.slice(1));
    for (let e = at; e; e = e.parentElement) if (e.tagName === "DETAILS") e.open = true;
  };
  window.addEventListener("hashchange", opened);
  opened();
  const close = () => document.querySelector("figure:target .close")?.click();
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") close(); });
  document.addEventListener("click", (event) => {
    if (!event.target.closest("figure:target a:not(.close)")) return;
    event.preventDefault();
    close();
  });

  front();
  mechanism();
})();
