// Checks pages of `dose3 score --html` in a real browser: node check.mjs CHROMIUM PAGE... [--shots FOLDER]
import assert from "node:assert/strict";
import { mkdirSync, writeFileSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser } from "./browser.mjs";

const [program, ...rest] = process.argv.slice(2);
const option = rest.indexOf("--shots");
const shots = option >= 0 ? rest.splice(option, 2)[1] : null;

// The share of a canvas that something was drawn on.
const inked = `[...document.querySelectorAll("canvas")].map(canvas => {
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let drawn = 0;
  for (let i = 3; i < pixels.length; i += 4) drawn += pixels[i] > 0;
  return drawn / (pixels.length / 4);
})`;

async function log(browser) {
  const data = await browser.evaluate("data");
  const charts = 1 + (data.poses ? 1 : 0) + data.quantities.of.length;
  const drawn = await browser.evaluate(inked);
  assert.equal(drawn.length, charts, "a canvas for each chart");
  drawn.forEach((share, i) => assert.ok(share > 0.002, `chart ${i} is empty: ${share}`));
  const traces = await browser.evaluate(`["above", "side"].map(id => document.querySelectorAll("#" + id + " path.trace").length)`);
  traces.forEach(count => assert.ok(count > 0, "a path is drawn"));
  const outside = await browser.evaluate(`document.documentElement.scrollWidth > innerWidth`);
  assert.ok(!outside, "nothing is wider than the page");

  // Pointing at a chart marks the path, and the other way round.
  await browser.point("#scores .u-over", 0.4, 0.5);
  const byChart = await browser.evaluate(`[document.getElementById("here").textContent, document.querySelector("#above .here").getAttribute("visibility")]`);
  assert.match(byChart[0], /score|no window/);
  assert.equal(byChart[1], "visible");
  const middle = await browser.evaluate(`(() => {
    const { x, y, root } = paths.views[0], i = x.length >> 1, box = root.viewBox.baseVal;
    return [x[i] / box.width, y[i] / box.height, data.path.t[i]];
  })()`);
  await browser.point("#above svg", middle[0], middle[1]);
  const cursor = await browser.evaluate("charts.all.map(chart => chart.posToVal(chart.cursor.left, 'x'))");
  cursor.forEach(t => assert.ok(Number.isFinite(t) && Math.abs(t - cursor[0]) < 1, "all charts follow the path"));
  assert.notEqual(await browser.evaluate(`document.getElementById("here").textContent`), byChart[0]);

  // A stretch is looked at from near, from the list and from the path, and left again.
  if (data.stretches.length) {
    const range = "charts.all.map(chart => chart.scales.x.max - chart.scales.x.min)";
    const whole = await browser.evaluate(range);
    await browser.point("ol.stretches button", 0.5, 0.5, true);
    assert.equal(await browser.evaluate(`document.querySelector("ol.stretches button").getAttribute("aria-pressed")`), "true");
    assert.ok(await browser.evaluate(`!!document.querySelector("#above .picked")`), "the stretch is marked on the path");
    const closer = await browser.evaluate(range);
    const worst = data.stretches.reduce((a, b) => (b.worst > a.worst ? b : a));
    if (worst.to - worst.from < 0.4 * data.duration) closer.forEach((width, i) => assert.ok(width < whole[i], "the charts look closer"));
    await browser.point("#whole", 0.5, 0.5, true);
    (await browser.evaluate(range)).forEach((width, i) => assert.ok(Math.abs(width - whole[i]) < 1e-6, "the charts show all again"));
    await browser.point("#above .number circle", 0.5, 0.5, true);
    assert.ok(await browser.evaluate(`!document.getElementById("whole").hidden`), "a number on the path is clicked");
    await browser.point("#whole", 0.5, 0.5, true);
  }
}

async function list(browser) {
  const addresses = await browser.evaluate(`[...document.querySelectorAll("table.logs a")].map(a => a.href)`);
  assert.ok(addresses.length > 0, "the list has logs");
  for (const address of addresses) {
    await browser.open(address);
    await log(browser);
    assert.deepEqual(browser.complaints(), [], address);
  }
}

const browser = await Browser.start(program);
try {
  for (const page of rest) {
    const address = pathToFileURL(resolve(page)).href;
    await browser.open(address);
    const isLog = await browser.evaluate(`!!document.getElementById("data")`);
    await (isLog ? log : list)(browser);
    assert.deepEqual(browser.complaints(), [], page);
    const printed = await browser.print();
    assert.equal(printed.subarray(0, 5).toString(), "%PDF-");
    if (shots) {
      mkdirSync(shots, { recursive: true });
      const to = name => join(shots, `${basename(page, ".html")}-${name}`);
      await browser.open(address);
      writeFileSync(to("light.png"), await browser.screenshot());
      writeFileSync(to("dark.png"), await browser.screenshot({ dark: true }));
      writeFileSync(to("narrow.png"), await browser.screenshot({ width: 420 }));
      await browser.screenshot();
      writeFileSync(to("print.pdf"), await browser.print());
    }
    console.log(`${page}: every chart drawn, pointing and clicking work, nothing on the console`);
  }
} finally {
  await browser.end();
}
