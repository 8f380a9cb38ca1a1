"use strict";
// The path from above and from the side: SVG, drawn anew for every view.
const WIDTH = 1040, MARGIN = 34;

function svg(name, attributes, parent) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) node.setAttribute(key, attributes[key]);
  if (parent) parent.appendChild(node);
  return node;
}

function text(parent, x, y, words, anchor) {
  svg("text", { x, y, "text-anchor": anchor || "start" }, parent).textContent = words;
}

// 1, 2 or 5 times a power of ten, at most `value`.
function round(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find(digit => digit * power <= value) * power;
}

function bounds(values, from, to) {
  let low = Infinity, high = -Infinity;
  for (let i = from; i < to; i++) {
    low = Math.min(low, values[i]);
    high = Math.max(high, values[i]);
  }
  return low <= high ? [low, high] : [0, 0];
}

class Paths {
  // `classOf` tells how unusual a score is; `on` hears of what is pointed at and clicked.
  constructor(data, classOf, on) {
    this.path = data.path;
    this.classOf = classOf;
    this.on = on;
    this.marks = [];
    this.hosts = ["above", "side"].map(id => document.getElementById(id));
    const breaks = new Set(this.path.breaks);
    this.pieces = [];
    this.path.t.forEach((_, i) => {
      if (i == 0 || breaks.has(i)) this.pieces.push([]);
      this.pieces[this.pieces.length - 1].push(i);
    });
  }

  // Draws the poses from time `from` to `to` as large as they fit; `picked` is that stretch where one is looked at.
  show(from, to, picked, stretches) {
    const path = this.path, count = path.t.length;
    let first = path.t.findIndex(t => t >= from), last = count;
    while (last > first && path.t[last - 1] > to) last--;
    if (first < 0) [first, last] = [0, count];
    const axes = [path.along, path.across, path.up].map(values => bounds(values, first, last));
    const size = axes.map(([low, high]) => high - low);
    const room = WIDTH - 2 * MARGIN;
    const least = Math.max(...size) * 1e-3 || 1;
    this.scale = Math.min(room / Math.max(size[0], least), 420 / Math.max(size[1], least), 300 / Math.max(size[2], least));
    const height = size[2] * this.scale;
    this.taller = [50, 20, 10, 5, 2, 1].find(times => height * times <= 150 || times == 1);
    const middle = axes.map(([low, high]) => (low + high) / 2);
    const heights = [Math.max(size[1] * this.scale, 90) + 2 * MARGIN, Math.max(height * this.taller, 60) + 2 * MARGIN];
    const x = path.along.map(v => WIDTH / 2 + (v - middle[0]) * this.scale);
    const ys = [
      path.across.map(v => heights[0] / 2 - (v - middle[1]) * this.scale),
      path.up.map(v => heights[1] / 2 - (v - middle[2]) * this.scale * this.taller),
    ];
    this.views = this.hosts.map((host, which) => this.draw(host, x, ys[which], heights[which], which, picked, stretches));
    document.getElementById("above-title").textContent = path.up_of_body
      ? "From above" : "Its longest and second longest direction";
    const times = this.taller > 1 ? ` (heights drawn ${this.taller} times as large)` : "";
    document.getElementById("side-title").textContent = (path.up_of_body ? "From the side" : "Its longest and shortest direction") + times;
  }

  draw(host, x, y, height, which, picked, stretches) {
    const root = svg("svg", { viewBox: `0 0 ${WIDTH} ${height.toFixed(0)}`, role: "img", "aria-label": which ? "path from the side" : "path from above" });
    const point = i => `${x[i].toFixed(1)} ${y[i].toFixed(1)}`;
    if (picked) {
      const within = this.pieces.map(piece => piece.filter(i => this.within(i, picked))).filter(piece => piece.length);
      svg("path", { class: "picked", d: within.map(piece => "M" + piece.map(point).join("L")).join("") }, root);
    }
    // The most unusual last, so that nothing hides it.
    const lines = { none: "", s0: "", s1: "", s2: "", s3: "", s4: "" };
    for (const piece of this.pieces) {
      let before = "";
      piece.slice(1).forEach((i, k) => {
        const name = this.classOf(this.path.score[i]);
        lines[name] += name == before ? `L${point(i)}` : `M${point(piece[k])}L${point(i)}`;
        before = name;
      });
    }
    for (const name in lines) if (lines[name]) svg("path", { class: `trace ${name}`, d: lines[name] }, root);
    this.ends(root, x, y);
    if (which == 0) this.bar(root, height);
    stretches.forEach((stretch, rank) => this.number(root, x, y, stretch, rank + 1, stretch.from === picked?.from && stretch.to === picked?.to));
    const here = svg("circle", { class: "here", r: 7, visibility: "hidden" }, root);
    host.replaceChildren(root);
    const view = { root, x, y, here };
    root.addEventListener("pointermove", event => this.point(event, view));
    root.addEventListener("pointerleave", () => this.on.leave());
    root.addEventListener("click", event => {
      const i = this.nearest(event, view);
      if (i >= 0) this.on.click(this.path.t[i]);
    });
    return view;
  }

  within(i, span) {
    return this.path.t[i] >= span.from && this.path.t[i] <= span.to;
  }

  ends(root, x, y) {
    const last = x.length - 1;
    svg("circle", { class: "end", cx: x[0], cy: y[0], r: 5 }, root);
    svg("rect", { class: "end", x: x[last] - 5, y: y[last] - 5, width: 10, height: 10 }, root);
    // The two labels on opposite sides, so that a closed course shows both.
    const left = x[0] <= x[last] ? 1 : -1;
    const label = (i, side, words) => text(root, x[i] + 10 * side, y[i] + 4, words, side > 0 ? "start" : "end");
    label(0, x[0] < 60 ? 1 : -left, "start");
    label(last, x[last] > WIDTH - 60 ? -1 : left, "end");
  }

  bar(root, height) {
    const metres = round(WIDTH / 5 / this.scale), width = metres * this.scale, y = height - 14;
    svg("path", { class: "bar", d: `M12 ${y - 5}v5h${width.toFixed(1)}v-5` }, root);
    const words = metres >= 1000 ? `${metres / 1000} km` : metres >= 1 ? `${metres} m` : metres >= 0.01 ? `${+(metres * 100).toFixed(3)} cm` : `${+(metres * 1000).toFixed(3)} mm`;
    text(root, 18 + width, y, words);
  }

  number(root, x, y, stretch, rank, on) {
    const i = this.at(stretch.at);
    const group = svg("g", { class: on ? "number on" : "number", transform: `translate(${x[i].toFixed(1)} ${(y[i] - 22).toFixed(1)})` }, root);
    svg("path", { class: "bar", d: "M0 10V19" }, group);
    svg("circle", { r: 10 }, group);
    text(group, 0, 0, rank, "middle");
    group.addEventListener("click", event => {
      event.stopPropagation();
      this.on.pick(stretch);
    });
  }

  // The drawn point nearest to the pointer, -1 beyond 40 units.
  nearest(event, view) {
    const box = view.root.getBoundingClientRect(), unit = WIDTH / box.width;
    const px = (event.clientX - box.left) * unit, py = (event.clientY - box.top) * unit;
    let best = -1, least = 40 * 40;
    for (let i = 0; i < view.x.length; i++) {
      const square = (view.x[i] - px) ** 2 + (view.y[i] - py) ** 2;
      if (square < least) [best, least] = [i, square];
    }
    return best;
  }

  point(event, view) {
    const i = this.nearest(event, view);
    if (i >= 0) this.on.hover(this.path.t[i]);
  }

  // The index of the drawn pose nearest in time.
  at(t) {
    const times = this.path.t;
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < t) low = middle + 1;
      else high = middle;
    }
    return low > 0 && t - times[low - 1] < times[low] - t ? low - 1 : low;
  }

  // Shows where the body is at time `t`; between two drawn poses, on the line.
  mark(t) {
    const after = Math.max(1, this.path.t.findIndex(other => other >= t)), before = after - 1;
    const span = this.path.t[after] - this.path.t[before];
    const u = span > 0 && t < this.path.t[after] ? Math.max(0, (t - this.path.t[before]) / span) : 1;
    for (const { x, y, here } of this.views) {
      here.setAttribute("cx", x[before] + u * (x[after] - x[before]));
      here.setAttribute("cy", y[before] + u * (y[after] - y[before]));
      here.setAttribute("visibility", "visible");
    }
  }

  unmark() {
    for (const { here } of this.views) here.setAttribute("visibility", "hidden");
  }
}
