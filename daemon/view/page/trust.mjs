// What may be trusted: from the newest surface and from what does not come. What is not known is not trusted.

// After so long without a surface nothing of the last one is shown any more.
export const kSilenceMs = 400;

const invalid = (why, remedy = "") => ({state: "invalid", permission: "use no position", why, remedy});
const seconds = (ms) => (ms < 10000 ? `${(ms / 1000).toFixed(1)} s` : `${Math.round(ms / 1000)} s`);

// link: {open, words, remedy}: the WebSocket, and why it is not open.
// publishers: how many perimapds publish in the domain; null: not told yet. sameSource: two of them under one name.
// surface: the newest one, as the server tells it; null: none.
// calibrating: what is being calibrated; empty: nothing.
// ageMs: since it came. lagMs: how much longer than others it was under way to this page.
export function judge({link, domain, publishers, sameSource, surface, ageMs, lagMs, recorded, calibrating}) {
  if (!link.open) return invalid(link.words, link.remedy ?? "is perimap view still running?");
  if (recorded && !surface) return invalid("the recording has no surface here");
  if (!surface && calibrating) return invalid(`the set-up is being measured: ${calibrating}`, "follow what is said below");
  if (!surface && publishers === 0) {
    return invalid(`nobody publishes in DDS domain ${domain}`, "start perimapd, or give perimap view its --domain");
  }
  if (!surface) return invalid("no surface has come yet");
  const oldMs = ageMs + (recorded ? 0 : lagMs);
  if (!(ageMs <= kSilenceMs)) {
    const told = Number.isFinite(ageMs) ? ` for ${seconds(ageMs)}` : "";
    return recorded ? invalid(`nothing was published${told}`)
                    : invalid(`nothing has come from perimapd${told}`, "look whether perimapd still runs");
  }
  if (!(oldMs <= kSilenceMs)) return invalid("this page is behind", "close other pages; is the network, or this computer, too slow?");
  if (!(oldMs <= surface.valid_for_ms)) {
    return surface.valid_for_ms > 0 ? invalid("the next surface is late: the last one may not be used any more")
                                    : invalid("the surface came after its time", "is the network, or this computer, too slow?");
  }
  const {state, permission, why, remedy} = surface;
  if (state !== "good" && state !== "degraded") return {...invalid(why || "perimapd says so", remedy), surface};
  if (sameSource) {
    return {...invalid(`two perimapds publish as '${surface.source}'`, "end one of them, or give each a source.name of its own"),
            contested: true};
  }
  if (publishers > 1) {
    return {state: "degraded", permission: "use with care", why: `${publishers} perimapds publish here: '${surface.source}' is shown`,
            remedy: "end the others", surface, uses: usesOf(surface, "degraded"), contested: true};
  }
  return {state, permission, why, remedy, surface, uses: usesOf(surface, "good")};
}

export const kOrder = {invalid: 0, degraded: 1, good: 2};
export const worse = (a, b) => ((kOrder[a] ?? 0) <= (kOrder[b] ?? 0) ? a : b);

const kUses = {display: "show it", measure: "measure in it", contact: "touch it"};
const kUseMarks = {good: "\u2713", degraded: "!", invalid: "\u2715"};

// What a surface may be used for, as [{state, words}], none better than `atBest`. Older perimapds tell of none.
export function usesOf({uses}, atBest) {
  return Object.entries(uses ?? {}).filter(([use]) => use in kUses).map(([use, told]) => {
    const state = worse(told.state in kOrder ? told.state : "invalid", atBest);
    return {state, words: `${kUseMarks[state]} ${kUses[use]}: ${told.features} within ${told.within_mm} mm`};
  });
}
// So long what is worse stays on the page, for what lasts one frame is not read else.
export const kHeldMs = 800;

// The higher, the more is allowed: of equal states the one that allows more uses.
const rank = ({state, uses}) => 10 * kOrder[state] + (uses ?? []).reduce((sum, use) => sum + kOrder[use.state], 0);

// Keeps the worst of what was judged lately.
export class Held {
  constructor() { this.shown = null; }

  take(judged, nowMs) {
    if (!this.shown || rank(judged) <= rank(this.shown) || !(nowMs - this.at <= kHeldMs)) {
      this.shown = judged;
      this.at = nowMs;
    }
    return this.shown;
  }
}

// How much longer than the quickest of the last minutes a message was under way: two clocks that begin and run a little
// differently tell that, and no more.
export class Lag {
  static kMinuteMs = 60000;

  constructor() {
    this.quickest = [Infinity, Infinity];  // of this minute and the one before
    this.begun = -Infinity;
  }

  take(sentMs, nowMs) {
    if (nowMs - this.begun > Lag.kMinuteMs) {
      this.quickest = [Infinity, this.quickest[0]];
      this.begun = nowMs;
    }
    this.quickest[0] = Math.min(this.quickest[0], nowMs - sentMs);
    return nowMs - sentMs - Math.min(...this.quickest);
  }
}
