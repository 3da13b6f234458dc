// Headless Chromium, driven through its debugging pipe (the DevTools protocol): opens pages, asks them, keeps what their
// consoles say and what they request.
import {spawn} from "node:child_process";
import {mkdtempSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";

// Notes in the page, by its own clock, when a message of each kind came last, and for how long its program could not run
// at most: what a test may ask of a page holds on a machine that is as slow as it likes.
export const watchClock = `(() => {
  const parse = JSON.parse;
  window.came = {};
  JSON.parse = (text, reviver) => {
    const message = parse(text, reviver);
    if (message?.kind) window.came[message.kind] = performance.now();
    return message;
  };
  let last = performance.now();
  window.stoodMs = 0;
  setInterval(() => {
    const now = performance.now();
    window.stoodMs = Math.max(window.stoodMs, now - last);
    last = now;
  }, 10);
})()`;

export const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export class Browser {
  static async open({width = 1280, height = 720} = {}) {
    const browser = new Browser();
    browser.profile = mkdtempSync(join(tmpdir(), "perimap-browser-"));
    browser.process = spawn("chromium", [
      "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--mute-audio",
      "--disable-background-networking", "--disable-backgrounding-occluded-windows", "--disable-component-update", "--remote-debugging-pipe",
      `--user-data-dir=${browser.profile}`, `--window-size=${width},${height}`, "about:blank",
    ], {stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"]});
    browser.size = {width, height};
    browser.asked = new Map();
    browser.pages = new Map();
    browser.last = 0;
    let rest = "";
    browser.process.stdio[4].setEncoding("utf8").on("data", (data) => {
      const messages = (rest + data).split("\0");
      rest = messages.pop();
      for (const message of messages) browser.take(JSON.parse(message));
    });
    return browser;
  }

  take(message) {
    if (message.id) {
      const {resolve, reject} = this.asked.get(message.id);
      this.asked.delete(message.id);
      if (message.error) reject(new Error(JSON.stringify(message.error)));
      else resolve(message.result);
    } else if (message.sessionId) {
      this.pages.get(message.sessionId)?.event(message.method, message.params);
    }
  }

  ask(method, params = {}, sessionId = undefined) {
    const id = ++this.last;
    return new Promise((resolve, reject) => {
      this.asked.set(id, {resolve, reject});
      this.process.stdio[3].write(`${JSON.stringify({id, method, params, sessionId})}\0`);
    });
  }

  async page(url) {
    const {targetId} = await this.ask("Target.createTarget", {url: "about:blank", newWindow: true});
    const {sessionId} = await this.ask("Target.attachToTarget", {targetId, flatten: true});
    const page = new Page(this, sessionId, targetId);
    this.pages.set(sessionId, page);
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await page.ask(`${domain}.enable`);
    await page.ask("Emulation.setDeviceMetricsOverride", {...this.size, deviceScaleFactor: 1, mobile: false});
    await page.ask("Page.navigate", {url});
    await Promise.race([page.loaded, pause(30000)]);
    return page;
  }

  async close() {
    await Promise.race([this.ask("Browser.close").catch(() => {}), pause(5000)]);
    this.process.kill("SIGKILL");
    await pause(200);
    rmSync(this.profile, {recursive: true, force: true, maxRetries: 5, retryDelay: 200});
  }
}

class Page {
  constructor(browser, session, target) {
    Object.assign(this, {browser, session, target, complaints: [], requests: []});
    this.loaded = new Promise((resolve) => { this.load = resolve; });
  }

  ask(method, params) { return this.browser.ask(method, params, this.session); }
  close() { return this.browser.ask("Target.closeTarget", {targetId: this.target}); }

  event(method, params) {
    if (method === "Page.loadEventFired") {
      this.load();
    } else if (method === "Runtime.consoleAPICalled" && (params.type === "error" || params.type === "warning")) {
      this.complaints.push(params.args.map((arg) => arg.value ?? arg.description).join(" "));
    } else if (method === "Runtime.exceptionThrown") {
      this.complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    } else if (method === "Log.entryAdded") {
      this.complaints.push(`${params.entry.level}: ${params.entry.text} ${params.entry.url ?? ""}`);
    } else if (method === "Network.requestWillBeSent") {
      this.requests.push(params.request.url);
    } else if (method === "Network.webSocketCreated") {
      this.requests.push(params.url);
    }
  }

  async evaluate(expression) {
    const {result, exceptionDetails} = await this.ask("Runtime.evaluate", {expression, awaitPromise: true, returnByValue: true});
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  // Until the expression is true; false when it is not within that time.
  async until(expression, ms) {
    for (const end = Date.now() + ms; Date.now() < end; await pause(20)) {
      if (await this.evaluate(expression)) return true;
    }
    return false;
  }

  async screenshot(file) {
    const {data} = await this.ask("Page.captureScreenshot", {format: "png"});
    writeFileSync(file, Buffer.from(data, "base64"));
  }
}
