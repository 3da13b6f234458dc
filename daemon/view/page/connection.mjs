// The WebSocket to perimap view, opened again whenever it closes.

const kAgainMs = 1000;

export class Connection {
  // onMessage: a parsed text message, or {kind: "picture", blob}.
  constructor(onMessage) {
    this.onMessage = onMessage;
    this.link = {open: false, words: "the page is not connected yet"};
    this.connect();
  }

  connect() {
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.binaryType = "blob";
    this.socket = socket;
    socket.addEventListener("open", () => { this.link = {open: true, words: ""}; });
    socket.addEventListener("message", ({data}) => {
      this.onMessage(typeof data === "string" ? JSON.parse(data) : {kind: "picture", blob: data});
    });
    socket.addEventListener("close", ({reason}) => {
      this.link = {open: false, words: reason || "perimap view does not answer"};
      setTimeout(() => this.connect(), kAgainMs);
    });
  }

  say(what) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(what));
  }
}
