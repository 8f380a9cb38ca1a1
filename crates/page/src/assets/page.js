"use strict";
// What belongs together: the path, the charts, the list of stretches.
const data = JSON.parse(document.getElementById("data").textContent);

// 12.4 s, 3:20, 1:02:00
function clock(seconds) {
  if (data.duration < 300) return `${+seconds.toFixed(2)} s`;
  const whole = Math.round(seconds), two = n => String(n).padStart(2, "0");
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

// How unusual a score is: 0 is a usual trusted window, 1 the threshold.
const CLASSES = [
  ["s0", 0.5, "as usual trusted windows"],
  ["s1", 1, "near the threshold"],
  ["s2", 2, "beyond it"],
  ["s3", 5, "far beyond"],
  ["s4", Infinity, "very far beyond"],
];
function classOf(score) {
  if (score === null) return "none";
  const u = (score - data.usual) / Math.max(data.threshold - data.usual, 1e-9);
  return CLASSES.find(([, limit]) => u <= limit)[0];
}

const byWorst = [...data.stretches].sort((a, b) => b.worst - a.worst);
const numbered = byWorst.slice(0, 12);
const readout = document.getElementById("readout"), here = document.getElementById("here"), whole = document.getElementById("whole");
const buttons = [...document.querySelectorAll("[data-from]")];
const placeOf = button => ({ from: +button.dataset.from, to: +button.dataset.to });
const same = (a, b) => a && b && Math.abs(a.from - b.from) < 2e-3 && Math.abs(a.to - b.to) < 2e-3;
let picked = null;

const on = {
  hover(t) {
    const i = paths.at(t), { row, score } = data.path;
    const said = score[i] === null ? "no window reaches" : `score ${score[i]} (threshold ${+data.threshold.toFixed(2)})`;
    here.textContent = `${clock(t)} · ${data.row_kind} ${row[i]} · ${said}`;
    readout.hidden = false;
    paths.mark(t);
    charts.follow(t);
  },
  leave() {
    here.textContent = "";
    readout.hidden = !picked;
    paths.unmark();
    charts.unfollow();
  },
  click(t) {
    const found = byWorst.find(stretch => t >= stretch.from && t <= stretch.to);
    if (found) on.pick(found);
  },
  // Looks at a place from near; at the whole log where it is the one already looked at.
  pick(place) {
    picked = same(place, picked) ? null : place;
    show();
  },
};

function show() {
  charts.pick(picked);
  const margin = picked ? Math.max(0.35 * (picked.to - picked.from), 1) : 0;
  const from = picked ? Math.max(0, picked.from - margin) : 0;
  const to = picked ? Math.min(data.duration, picked.to + margin) : data.duration;
  charts.zoom(from, to);
  paths.show(from, to, picked, numbered);
  whole.hidden = !picked;
  readout.hidden = !picked && !here.textContent;
  for (const button of buttons) button.setAttribute("aria-pressed", same(placeOf(button), picked) ? "true" : "false");
}

function legend() {
  const host = document.getElementById("legend");
  const scores = new Set(data.path.score.map(classOf));
  for (const [name, , words] of [...CLASSES, ["none", 0, "no window reaches"]]) {
    if (!scores.has(name)) continue;
    const item = document.createElement("span");
    const sample = svg("svg", { viewBox: "0 0 40 10" }, item);
    svg("path", { class: `trace ${name}`, d: "M3 5h34" }, sample);
    item.append(words);
    host.append(item);
  }
}

const paths = new Paths(data, classOf, on);
const charts = new Charts(data, classOf, on);
legend();
document.getElementById("motion-hint").textContent = data.quantities.of.some(quantity => quantity.band)
  ? "The green band is what trusted logs keep to: all but two of a thousand poses. What the reasons speak of comes first."
  : "As the body sees it.";
show();

for (const button of buttons) button.addEventListener("click", () => on.pick(placeOf(button)));
whole.addEventListener("click", () => on.pick(picked));
document.addEventListener("keydown", event => event.key == "Escape" && picked && on.pick(picked));
let resizing;
addEventListener("resize", () => {
  clearTimeout(resizing);
  resizing = setTimeout(() => charts.draw(), 150);
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.draw());
// On paper everything is open and light.
addEventListener("beforeprint", () => {
  document.documentElement.dataset.print = "";
  document.querySelectorAll("details").forEach(details => { details.open = true; });
  charts.draw();
});
addEventListener("afterprint", () => {
  delete document.documentElement.dataset.print;
  charts.draw();
});
