// What may be trusted: from the newest surface and from what does not come.

// After so long without a surface nothing of the last one is shown any more.
export const kSilenceMs = 400;

const invalid = (why, remedy = "") => ({state: "invalid", permission: "use no position", why, remedy});

// link: {open, words}: the WebSocket, and why it is not open.
// publishers: how many perimapds are in the domain; null: not told yet. Of a recording: null.
// surface: the newest one, as the server tells it; null: none.
// ageMs: since it came. lagMs: how much longer than the quickest the newest was under way to this page.
export function judge({link, domain, publishers, surface, ageMs, lagMs, recorded}) {
  if (!link.open) return invalid(link.words, "is perimap view still running?");
  if (recorded && !surface) return invalid("the recording has no surface here");
  if (!surface && publishers === 0) {
    return invalid(`nobody publishes in DDS domain ${domain}`, "start perimapd, or give perimap view its --domain");
  }
  if (!surface) return invalid("no surface has come yet");
  if (ageMs > kSilenceMs) {
    const since = ageMs < 10000 ? `${(ageMs / 1000).toFixed(1)} s` : `${Math.round(ageMs / 1000)} s`;
    return invalid(recorded ? `nothing was published for ${since}` : `nothing has come from perimapd for ${since}`,
                   recorded ? "" : "look whether perimapd still runs");
  }
  if (lagMs > kSilenceMs) return invalid(`this page is ${(lagMs / 1000).toFixed(1)} s behind`, "close other pages");
  if (surface.expired) return invalid("the surface came after its time", "is the network, or this computer, too slow?");
  const {state, permission, why, remedy} = surface;
  if (state !== "good" && state !== "degraded") return {...invalid(why || "perimapd says so", remedy), surface};
  return {state, permission, why, remedy, surface};
}

const kOrder = {invalid: 0, degraded: 1, good: 2};
// So long what is worse stays on the page, for what lasts one frame is not read else.
export const kHeldMs = 800;

// Keeps the worst of what was judged lately.
export class Held {
  constructor() { this.shown = null; }

  take(judged, nowMs) {
    if (!this.shown || kOrder[judged.state] <= kOrder[this.shown.state] || nowMs - this.at > kHeldMs) {
      this.shown = judged;
      this.at = nowMs;
    }
    return this.shown;
  }
}
