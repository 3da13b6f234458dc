// How far the tips of tracked tools are from the surface, in words.
import {worse} from "./trust.mjs";

export const kToolColour = "#ff73cc", kTouchColour = "#ffffff";
const kStillMmPerS = 2;  // slower neither approaches nor goes away

export const shortName = (tool) => tool.replace(/^instrument\//, "");

// {state, words, touches} of a tool as the server tells it. Nothing is told of one beside a surface that is not to be used.
export function toolWords(tool, surfaceState = "good") {
  const name = shortName(tool.tool), state = worse(tool.state, surfaceState);
  if (state === "invalid" || tool.distance_mm === null) {
    const why = surfaceState === "invalid" ? "not known" : tool.why || "not known";
    return {state: "invalid", words: `${name}: ${why}`, touches: false};
  }
  const speed = Math.abs(tool.rate_mm_per_s).toFixed(0);
  const way = Math.abs(tool.rate_mm_per_s) < kStillMmPerS ? "" : tool.rate_mm_per_s < 0 ? `, coming ${speed} mm/s` : `, going ${speed} mm/s`;
  const far = `${tool.distance_mm.toFixed(1)} \u00b1 ${tool.deviation_mm.toFixed(1)} mm`;
  return {state, touches: tool.touches, words: tool.touches ? `${name} TOUCHES (${far})` : `${name} ${far}${way}`};
}

export class Tools {
  constructor(list) {
    this.list = list;
    this.shown = "";
  }

  show(tools, surfaceState) {
    const lines = tools.map((tool) => toolWords(tool, surfaceState)), now = JSON.stringify(lines);
    if (now === this.shown) return;
    this.shown = now;
    this.list.hidden = !lines.length;
    this.list.replaceChildren(...lines.map(({state, words, touches}) => {
      const item = document.createElement("li");
      item.textContent = words;
      item.className = touches ? `${state} touches` : state;
      return item;
    }));
  }
}
