// The page: takes what perimap view sends, judges what may be trusted, draws.
import {measure} from "./canvas.mjs";
import {Connection} from "./connection.mjs";
import {Delays} from "./delays.mjs";
import {Guidance} from "./guidance.mjs";
import {Picture} from "./picture.mjs";
import {Scene} from "./scene.mjs";
import {showFacts, showSources} from "./sources.mjs";
import {Strip} from "./strip.mjs";
import {Timeline} from "./timeline.mjs";
import {Tools} from "./tools.mjs";
import {Held, judge, Lag} from "./trust.mjs";

const $ = (id) => document.getElementById(id);
const kJudgeMs = 50;
// A status comes each second.
const kStatusMs = 2500;

measure();
addEventListener("resize", measure);
// The token is in a cookie now; the address without it can be shown to others.
if (location.search) history.replaceState(null, "", "/");

const scene = new Scene($("scene")), strip = new Strip($("strip")), delays = new Delays($("delays"));
const picture = new Picture($("picture")), tools = new Tools($("tools"));
const guidance = new Guidance({section: document.querySelector("section.guidance"), what: $("guided-what"), line: $("guided-line"),
                               clock: $("guided-clock"), bar: $("guided-bar"), canvas: $("guided-picture")});
const seen = {};
// Nothing of what was shown is of what comes now.
function forget() {
  Object.assign(seen, {surface: null, status: null, told: null, cameAt: -Infinity, lagMs: 0, ageMs: Infinity, source: ""});
  lag = new Lag();
  held = new Held();
  strip.forget();
  delays.forget();
  scene.reset();
  picture.forget();
  $("sources").innerHTML = '<tr><td colspan="4">no status has come yet</td></tr>';
  $("facts").replaceChildren();
}
let lag, held, failed = null;
let judged = {state: "invalid"};
forget();
Object.assign(seen, {recorded: false, domain: 0, publishers: null, contest: "", warnings: []});

const timeline = new Timeline(
  {footer: $("timeline"), button: $("play"), slider: $("time"), clock: $("clock"), states: $("states")},
  (question) => {
    if (!question.from_here) {
      strip.forget();
    }
    connection.say(question);
  });

const take = {
  hello(message) {
    forget();
    seen.recorded = message.mode === "recording";
    seen.domain = message.domain;
    seen.contest = "";
    document.title = seen.recorded ? `perimap: ${message.name}` : "perimap";
    document.querySelector("section.delays").hidden = seen.recorded;
    document.querySelector(".side").hidden = seen.recorded && !message.statuses;
    document.querySelector("section.picture").hidden = !message.pictures;
    document.body.classList.toggle("bare", seen.recorded && !message.statuses);
    document.body.classList.toggle("pictures", Boolean(message.pictures));
    document.body.classList.toggle("recording", seen.recorded);
    seen.warnings = message.warnings ?? [];
    if (seen.recorded) timeline.begin(message);
  },
  publishers(message) {
    seen.publishers = message.count;
    seen.sameSource = message.same_source;
    seen.contest = message.count > 1 ? `${message.count} perimapds publish in DDS domain ${message.domain}: one of them is shown. End the others.` : "";
  },
  following({source, stream}) {
    forget();
    seen.source = `${source}, by ${stream === "frame" ? "frames" : "a clock"}`;
  },
  surface(message) {
    seen.surface = message;
    if (!seen.recorded) {
      seen.cameAt = performance.now();
      seen.lagMs = lag.take(message.sent_ms, seen.cameAt);
      delays.add(seen.cameAt, message.late_ms, message.lost);
    }
    strip.surface(message);
    // Also of one that the next has replaced before the page draws.
    if (!seen.recorded) tell();
  },
  phase(message) {
    strip.phase(message);
  },
  status({status}) {
    seen.status = status;
    seen.statusAt = performance.now();
    tellStatus();
  },
  moment({messages}) {
    for (const message of messages) take[message.kind]?.(message);
  },
  // A surface before the one that is shown.
  past(message) {
    strip.surface(message);
  },
  // Live there is none but that of a calibration.
  picture({blob}) {
    if (seen.recorded) picture.blob(blob);
    else guidance.picture(blob);
  },
  guidance(message) {
    guidance.take(message, performance.now());
  },
  overlay(message) {
    picture.overlay(message);
  },
  damage({words}) {
    seen.warnings = [...seen.warnings, words];
  },
  ecg(message) {
    strip.ecg(message);
  },
  at(message) {
    timeline.answered();
    seen.atMs = message.at_ms;
    seen.ageMs = message.surface_age_ms ?? Infinity;
    if (message.surface_age_ms === null) seen.surface = null;
  },
};

const connection = new Connection((message) => take[message.kind]?.(message));

// Written only when it changes, so that a screen reader does not read it ten times a second.
function set(id, text) {
  if ($(id).textContent !== text) $(id).textContent = text;
}

function tell() {
  const now = performance.now(), ageMs = seen.recorded ? seen.ageMs : now - seen.cameAt;
  const latest = failed ?? judge({...seen, link: connection.link, ageMs, calibrating: guidance.what(now)});
  judged = seen.recorded ? latest : held.take(latest, now);
  if ($("trust").dataset.state !== judged.state) $("trust").dataset.state = judged.state;
  for (const part of ["state", "permission", "why", "remedy"]) set(part, judged[part]);
  tellUses(judged.uses ?? []);
  // Once is enough, so that there is room for the rest.
  const [first, ...others] = [judged.contested ? "" : seen.contest, ...seen.warnings].filter(Boolean);
  set("warning-words", first ?? "");
  set("warning-details", others.join(" \u00b7 "));
  $("warning").hidden = !first;
  const {surface} = judged;
  set("converged", `${surface?.converged ?? 0} converged`);
  set("known", surface ? `of ${surface.known}` : "");
  const mesh = surface?.mesh?.triangles ? `mesh of ${surface.mesh.triangles.length / 3} triangles` : "";
  set("surface-words", [surface ? seen.source : "", mesh, surface?.mesh?.words].filter(Boolean).join(" \u00b7 "));
  tools.show(seen.surface?.tools ?? [], judged.state);
  // Drawn by this very program, so that a page that stands still is seen to.
  set("life", connection.link.open ? "\u25d0\u25d3\u25d1\u25d2"[Math.floor(now / 250) % 4] : "\u25cb");
}

let shownUses = "";
function tellUses(uses) {
  const now = JSON.stringify(uses);
  if (now === shownUses) return;
  shownUses = now;
  $("uses").replaceChildren(...uses.map(({state, words}) => {
    const use = document.createElement("span");
    use.textContent = words;
    use.className = state;
    return use;
  }));
}

// How the sources are now, or that it is not known.
function tellStatus() {
  if (!seen.status) return;
  const known = connection.link.open && (seen.recorded || performance.now() - seen.statusAt < kStatusMs);
  if (seen.told === seen.status && seen.toldKnown === known) return;
  showSources($("sources"), seen.status.sources, known);
  if (known) showFacts($("facts"), seen.status);
  else $("facts").replaceChildren();
  Object.assign(seen, {told: seen.status, toldKnown: known});
}

// The publisher's clock now, from the surface that came last.
function nowMs() {
  if (seen.recorded) return seen.atMs ?? null;
  return seen.surface ? seen.surface.received_ms + performance.now() - seen.cameAt : null;
}

function draw() {
  requestAnimationFrame(draw);
  timeline.advance();
  tell();
  scene.draw(judged.state === "invalid" ? null : seen.surface, judged.state);
  picture.draw(judged.state);
  guidance.draw(performance.now());
  document.body.classList.toggle("guided", Boolean(guidance.told) && !seen.surface);
  strip.draw(nowMs(), judged.state === "invalid");
  timeline.draw();
}

// What a page that has failed still shows is not to be believed.
function fail() {
  failed = {state: "invalid", permission: "use no position", why: "this page has failed", remedy: "reload it"};
  document.querySelectorAll("canvas").forEach((canvas) => { canvas.width = canvas.width; });
  tell();
}
addEventListener("error", fail);
addEventListener("unhandledrejection", fail);

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target !== document.body) return;
  if (timeline.key(event.key) || scene.key(event.key)) event.preventDefault();
});
// Judged without drawing too: a page that is covered draws nothing.
setInterval(tell, kJudgeMs);
setInterval(() => {
  tellStatus();
  delays.draw(performance.now());
  set("delay-words", delays.words());
  set("heart-words", seen.recorded || strip.samples.length || !strip.phases.length ? "" : "the ECG itself is not published");
}, 500);
requestAnimationFrame(draw);
