"use strict";
// Charts over time, by uPlot: one cursor and one range of time for all of them.
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

// Ticks of a scale that is even near 0 and grows by decades beyond: 0, and 1, 2, 5 times powers of ten that lie apart.
function spread(u, axis, low, high) {
  const found = [0], largest = Math.max(Math.abs(low), Math.abs(high));
  for (let power = Math.ceil(Math.log10(largest)); power >= -6; power--) {
    for (const digit of [1, 5, 2]) found.push(digit * 10 ** power, -digit * 10 ** power);
  }
  const kept = [];
  for (const value of found) {
    if (value < low || value > high) continue;
    const at = u.valToPos(value, "y");
    if (kept.every(other => Math.abs(u.valToPos(other, "y") - at) >= 24)) kept.push(value);
  }
  return kept.sort((a, b) => a - b);
}

class Charts {
  constructor(data, classOf, on) {
    this.data = data;
    this.classOf = classOf;
    this.on = on;
    this.range = null;
    this.picked = null;
    this.all = [];
    this.draw();
  }

  // Draws all charts anew, at the present width and in the present colours.
  draw() {
    this.all.forEach(chart => chart.destroy());
    this.all = [this.scores()];
    const poses = this.poses();
    if (poses) this.all.push(poses);
    // All places first: a grid with one of them is as wide as the page.
    const hosts = this.data.quantities.of.map((quantity, i) => this.host(quantity, i));
    this.data.quantities.of.forEach((quantity, i) => this.all.push(this.quantity(quantity, hosts[i])));
    if (this.range) this.zoom(...this.range);
  }

  scores() {
    const { windows, threshold } = this.data;
    const known = windows.score.filter(v => v !== null);
    const far = Math.max(...known) > 8 * Math.max(threshold, 1);
    return this.chart(document.getElementById("scores"), "score of windows", [windows.t, windows.score], {
      height: 240,
      y: far ? { distr: 4, asinh: Math.max(threshold, 1) } : {},
      least: [threshold],
      stroke: colour("--line"),
      over: u => {
        this.limit(u, threshold, "threshold");
        this.dots(u);
      },
    });
  }

  poses() {
    const { poses, pose_threshold: limit } = this.data;
    const host = document.getElementById("poses");
    host.hidden = !poses;
    return poses && this.chart(host, "score of single poses, times a trusted extreme", [poses.t, poses.v], {
      height: 150,
      least: [0, limit],
      stroke: colour("--s0"),
      over: u => this.limit(u, limit, "one trusted pose in 1000"),
    });
  }

  host(quantity, i) {
    const id = `quantity-${i}`;
    let host = document.getElementById(id);
    if (!host) {
      host = document.createElement("div");
      host.id = id;
      host.className = quantity.drives ? "drives" : "";
      document.getElementById("quantities").appendChild(host);
    }
    return host;
  }

  quantity({ name, unit, band, v }, host) {
    // Values far outside of the band would make a line of it.
    const reach = band ? Math.max(Math.abs(band[0]), Math.abs(band[1])) : 0;
    const far = reach > 0 && v.some(value => value !== null && Math.abs(value) > 8 * reach);
    return this.chart(host, unit ? `${name}, ${unit}` : name, [this.data.quantities.t, v], {
      height: 170,
      y: far ? { distr: 4, asinh: reach } : {},
      least: band || [],
      stroke: colour("--s0"),
      under: u => band && this.band(u, band),
    });
  }

  chart(host, title, series, { height, y = {}, least = [], stroke, under, over }) {
    const axis = { stroke: colour("--muted"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1 }, font: "12px system-ui, sans-serif" };
    const range = (u, low, high) => {
      const [bottom, top] = [Math.min(low ?? 0, ...least), Math.max(high ?? 1, ...least)];
      return y.distr ? uPlot.rangeAsinh(bottom, top, 10, true) : uPlot.rangeNum(bottom, top, 0.08, true);
    };
    const chart = new uPlot({
      title, height, width: Math.max(host.clientWidth, 280),
      padding: [8, 26, 0, 0],
      scales: { x: { time: false, range: (u, low, high) => [low ?? 0, high > low ? high : (low ?? 0) + 1] }, y: { ...y, range } },
      axes: [{ ...axis, values: (u, splits) => splits.map(clock) }, { ...axis, size: 62, ...(y.distr ? { splits: spread, filter: (u, splits) => splits, values: (u, splits) => splits.map(value => +value.toPrecision(3)) } : {}) }],
      series: [{}, { stroke, width: 1.25, points: { show: false } }],
      cursor: { sync: { key: "t" }, drag: { x: true, y: false }, points: { size: 7, fill: colour("--fg") } },
      hooks: {
        drawAxes: [u => { this.shade(u); if (under) under(u); }],
        draw: [u => over && over(u)],
        setCursor: [u => this.moved(u)],
        setScale: [(u, key) => key == "x" && this.scaled(u)],
      },
    }, series, host);
    chart.over.addEventListener("click", event => this.clicked(chart, event));
    return chart;
  }

  // The stretches and gaps behind the lines.
  shade(u) {
    const { left, top, width, height } = u.bbox;
    const box = (from, to, fill) => {
      const a = Math.max(left, u.valToPos(from, "x", true)), b = Math.min(left + width, u.valToPos(to, "x", true));
      u.ctx.fillStyle = fill;
      if (b > a) u.ctx.fillRect(a, top, Math.max(b - a, 2), height);
    };
    u.ctx.save();
    for (const [from, to] of this.data.gaps) box(from, to, colour("--gap"));
    for (const stretch of this.data.stretches) box(stretch.from, stretch.to, colour("--stretch"));
    for (const [from, to] of this.data.spans) box(from, to, colour("--stretch"));
    if (this.picked) box(this.picked.from, this.picked.to, colour("--stretch"));
    u.ctx.restore();
  }

  band(u, [low, high]) {
    const { left, width, top, height } = u.bbox;
    const a = Math.max(top, u.valToPos(high, "y", true)), b = Math.min(top + height, u.valToPos(low, "y", true));
    u.ctx.save();
    u.ctx.fillStyle = colour("--band");
    u.ctx.fillRect(left, a, width, b - a);
    u.ctx.restore();
  }

  limit(u, value, words) {
    const { left, width, top } = u.bbox, ratio = devicePixelRatio || 1;
    const y = u.valToPos(value, "y", true);
    u.ctx.save();
    u.ctx.strokeStyle = u.ctx.fillStyle = colour("--out");
    u.ctx.setLineDash([6 * ratio, 4 * ratio]);
    u.ctx.lineWidth = 1.5 * ratio;
    u.ctx.beginPath();
    u.ctx.moveTo(left, y);
    u.ctx.lineTo(left + width, y);
    u.ctx.stroke();
    u.ctx.font = `${12 * ratio}px system-ui, sans-serif`;
    u.ctx.textAlign = "right";
    u.ctx.fillText(words, left + width - 4 * ratio, y - top > 20 * ratio ? y - 5 * ratio : y + 14 * ratio);
    u.ctx.restore();
  }

  dots(u) {
    const [times, scores] = u.data, { min, max } = u.scales.x, ratio = devicePixelRatio || 1;
    const shown = times.filter(t => t >= min && t <= max).length;
    const size = (shown > 600 ? 1.8 : shown > 200 ? 2.6 : 4) * ratio;
    const fills = {};
    for (const name of ["s0", "s1", "s2", "s3", "s4"]) fills[name] = colour(`--${name}`);
    u.ctx.save();
    times.forEach((t, i) => {
      if (scores[i] === null || t < min || t > max) return;
      u.ctx.fillStyle = fills[this.classOf(scores[i])];
      u.ctx.beginPath();
      u.ctx.arc(u.valToPos(t, "x", true), u.valToPos(scores[i], "y", true), size, 0, 7);
      u.ctx.fill();
    });
    u.ctx.restore();
  }

  moved(u) {
    // Charts that only follow another's cursor stay silent, and so does a cursor that the path has set.
    if (this.following || u.cursor.event == null) return;
    const { left } = u.cursor;
    if (left < 0) this.on.leave();
    else this.on.hover(u.posToVal(left, "x"));
  }

  clicked(u, event) {
    if (u.select.width > 3) return;
    this.on.click(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x"));
  }

  scaled(u) {
    if (this.scaling) return;
    const { min, max } = u.scales.x;
    this.range = [min, max];
    this.zoom(min, max);
  }

  zoom(from, to) {
    this.scaling = true;
    this.range = [from, to];
    this.all.forEach(chart => chart.setScale("x", { min: from, max: to }));
    // uPlot applies scales in a microtask.
    queueMicrotask(() => queueMicrotask(() => { this.scaling = false; }));
  }

  pick(stretch) {
    this.picked = stretch;
    this.all.forEach(chart => chart.redraw(false, false));
  }

  // Puts the cursors of all charts at time `t`.
  follow(t) {
    this.following = true;
    for (const chart of this.all) chart.setCursor({ left: chart.valToPos(t, "x"), top: chart.cursor.top >= 0 ? chart.cursor.top : 10 }, false);
    this.following = false;
  }

  unfollow() {
    this.following = true;
    for (const chart of this.all) chart.setCursor({ left: -10, top: -10 }, false);
    this.following = false;
  }
}
