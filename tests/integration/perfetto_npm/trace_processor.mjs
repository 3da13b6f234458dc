// Perfetto's trace processor without a browser: its WebAssembly engine runs in this process, and is asked in SQL.
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { runInThisContext } from "node:vm";

// What its loader expects of a worker in a browser, and what it does not give away by itself.
const changes = [
  ["this.useMemory64 = hasMemory64Support();", "this.useMemory64 = false;"],
  ["locateFile: (s) => s,", "locateFile: (s) => s, wasmBinary: globalThis.perfettoEngine,"],
  [
    "const wasmBridge = new wasm_bridge_1.WasmBridge();",
    "const wasmBridge = new wasm_bridge_1.WasmBridge(); globalThis.perfettoBridge = wasmBridge;",
  ],
];

export async function openTrace(folder, file) {
  const at = (name) => resolve(folder, name);
  globalThis.self = globalThis;
  globalThis.WorkerGlobalScope = class {};
  globalThis.location = { href: pathToFileURL(folder).href + "/" };
  globalThis.perfettoEngine = new Uint8Array(readFileSync(at("trace_processor.wasm")));
  let loader = readFileSync(at("engine_bundle.node.js"), "utf8");
  for (const [from, to] of changes) {
    if (!loader.includes(from)) throw new Error(`the loader has no "${from}"`);
    loader = loader.replace(from, to);
  }
  runInThisContext(loader);
  const { EngineBase } = await import(pathToFileURL(at("engine.mjs")).href);
  class Engine extends EngineBase {
    mode = "WASM";
    id = "check";
    constructor(port) {
      super();
      this.port = port;
      port.onmessage = ({ data }) => this.onRpcResponseBytes(data);
    }
    rpcSendRequestBytes(data) {
      this.port.postMessage(data);
    }
  }
  const { port1, port2 } = new MessageChannel();
  globalThis.perfettoBridge.initialize(port1);
  const engine = new Engine(port2);
  console.warn = () => {}; // of fields of newer answers
  await engine.parse(new Uint8Array(readFileSync(file)));
  await engine.notifyEof();
  return {
    // Rows, with whole numbers as numbers.
    async query(sql) {
      const answer = await engine.query(sql);
      const rows = [];
      for (const row = answer.iter({}); row.valid(); row.next()) {
        rows.push(Object.fromEntries(answer.columns().map((column) => {
          const value = row.get(column);
          return [column, typeof value === "bigint" ? Number(value) : value];
        })));
      }
      return rows;
    },
    close: () => port2.close(),
  };
}
