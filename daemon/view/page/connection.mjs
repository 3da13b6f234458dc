// The WebSocket to perimap view, opened again whenever it closes.

const kAgainMs = 1000;
// perimap view gives a sign of life five times a second.
const kSilentMs = 1000, kDeadMs = 3000;

export class Connection {
  // onMessage: a parsed text message, or {kind: "picture", blob}.
  constructor(onMessage) {
    this.onMessage = onMessage;
    this.closed = {open: false, words: "the page is not connected yet"};
    this.connect();
  }

  connect() {
    const socket = new WebSocket(`ws://${location.host}/live`);
    let opened = false;
    socket.binaryType = "blob";
    this.socket = socket;
    socket.addEventListener("open", () => {
      opened = true;
      this.heardAt = performance.now();
      this.closed = null;
    });
    socket.addEventListener("message", ({data}) => {
      this.heardAt = performance.now();
      this.onMessage(typeof data === "string" ? JSON.parse(data) : {kind: "picture", blob: data});
    });
    socket.addEventListener("close", ({reason, code}) => {
      if (socket !== this.socket) return;
      this.closed = {open: false, words: reason || "perimap view does not answer"};
      if (code === 1013) this.closed.remedy = "";
      if (!opened) this.askWhyNot();
      setTimeout(() => this.connect(), kAgainMs);
    });
  }

  // A WebSocket that is refused does not say why; the page itself does.
  async askWhyNot() {
    const answer = await fetch("/", {cache: "no-store"}).catch(() => null);
    if (answer?.status === 403 && this.closed) Object.assign(this.closed, {words: (await answer.text()).trim(), remedy: ""});
  }

  get link() {
    if (this.closed) return this.closed;
    const silentMs = performance.now() - this.heardAt;
    if (silentMs > kDeadMs) {
      const socket = this.socket;
      this.closed = {open: false, words: "perimap view does not answer"};
      this.socket = null;
      socket.close();
      setTimeout(() => this.connect(), kAgainMs);
    }
    return silentMs > kSilentMs ? {open: false, words: "perimap view does not answer"} : {open: true, words: ""};
  }

  say(what) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(what));
  }
}
