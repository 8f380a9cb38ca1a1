// A headless Chromium, spoken to through a pipe: no package is needed.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const SECONDS = 60;

export class Browser {
  static async start(program) {
    const browser = new Browser();
    browser.profile = mkdtempSync(join(tmpdir(), "dose3-page-"));
    browser.process = spawn(program, [
      "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-pipe",
      "--no-first-run", "--disable-extensions", `--user-data-dir=${browser.profile}`, "about:blank",
    ], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    browser.next = 1;
    browser.waiting = new Map();
    browser.events = [];
    let text = "";
    browser.process.stdio[4].on("data", bytes => {
      text += bytes;
      const parts = text.split("\0");
      text = parts.pop();
      parts.forEach(part => browser.heard(JSON.parse(part)));
    });
    browser.process.on("exit", () => browser.waiting.forEach(({ reject }) => reject(new Error("the browser has ended"))));
    const { targetInfos } = await browser.call("Target.getTargets");
    const target = targetInfos.find(info => info.type == "page");
    const { sessionId } = await browser.call("Target.attachToTarget", { targetId: target.targetId, flatten: true });
    browser.session = sessionId;
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await browser.call(`${domain}.enable`);
    return browser;
  }

  heard(message) {
    if (!message.id) return void this.events.push(message);
    const { resolve, reject } = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    message.error ? reject(new Error(message.error.message)) : resolve(message.result);
  }

  call(method, params = {}) {
    const id = this.next++;
    return new Promise((resolve, reject) => {
      const late = setTimeout(() => reject(new Error(`${method}: no answer in ${SECONDS} s`)), SECONDS * 1000);
      const done = then => value => { clearTimeout(late); then(value); };
      this.waiting.set(id, { resolve: done(resolve), reject: done(reject) });
      this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId: this.session }) + "\0");
    });
  }

  // Opens a page; answers what went wrong on the console or was asked of the network.
  async open(address) {
    this.events = [];
    await this.call("Page.navigate", { url: address });
    await this.until(() => this.events.some(event => event.method == "Page.loadEventFired"));
    await this.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(done, 50)))");
  }

  async until(condition) {
    for (let i = 0; i < SECONDS * 50; i++) {
      if (condition()) return;
      await new Promise(done => setTimeout(done, 20));
    }
    throw new Error("waited in vain");
  }

  complaints() {
    return this.events.flatMap(({ method, params }) => {
      if (method == "Runtime.exceptionThrown") return [params.exceptionDetails.exception?.description ?? params.exceptionDetails.text];
      if (method == "Runtime.consoleAPICalled" && ["error", "warning"].includes(params.type)) return [params.args.map(a => a.value).join(" ")];
      if (method == "Log.entryAdded" && params.entry.level != "verbose") return [params.entry.text];
      if (method == "Network.requestWillBeSent" && !/^(file|data|about):/.test(params.request.url)) return [`asks for ${params.request.url}`];
      return [];
    });
  }

  async evaluate(expression) {
    const { result, exceptionDetails } = await this.call("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  // The pointer at the middle of an element, or at a share of its box.
  async point(selector, x = 0.5, y = 0.5, click = false) {
    const box = await this.evaluate(`(() => {
      const node = document.querySelector(${JSON.stringify(selector)});
      node.scrollIntoView({ block: "center" });
      const { left, top, width, height } = node.getBoundingClientRect();
      return [left, top, width, height];
    })()`);
    const at = { x: box[0] + x * box[2], y: box[1] + y * box[3] };
    await this.call("Input.dispatchMouseEvent", { type: "mouseMoved", ...at });
    if (click) for (const type of ["mousePressed", "mouseReleased"]) await this.call("Input.dispatchMouseEvent", { type, ...at, button: "left", clickCount: 1 });
    await this.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(done, 30)))");
  }

  async screenshot({ width = 1200, dark = false } = {}) {
    await this.call("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
    await this.call("Emulation.setDeviceMetricsOverride", { width, height: 1000, deviceScaleFactor: 1, mobile: false });
    await this.evaluate("new Promise(done => setTimeout(done, 400))");
    const { data } = await this.call("Page.captureScreenshot", { format: "png", captureBeyondViewport: true });
    return Buffer.from(data, "base64");
  }

  async print() {
    const { data } = await this.call("Page.printToPDF", { printBackground: false });
    return Buffer.from(data, "base64");
  }

  async end() {
    const gone = new Promise(done => this.process.on("exit", done));
    this.waiting.clear();
    this.process.stdio[3].write(JSON.stringify({ id: 0, method: "Browser.close" }) + "\0");
    const late = setTimeout(() => this.process.kill(), 5000);
    await gone;
    clearTimeout(late);
    rmSync(this.profile, { recursive: true, force: true });
  }
}
