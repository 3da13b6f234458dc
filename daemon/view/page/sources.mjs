// The sources with their rates and delays, and what else a status tells.

const kMarks = {ok: "\u2713", starting: "\u2026", ended: "\u25a0"};
const kNames = {r_trigger: "R trigger", ecg: "ECG"};

// A number that is none is null in JSON.
const figure = (value) => (Number.isFinite(value) ? value.toFixed(1) : "?");

const cell = (text) => {
  const element = document.createElement("td");
  element.textContent = text;
  return element;
};

// known: whether the status is new enough to say how they are now.
export function showSources(body, sources, known) {
  body.replaceChildren(...Object.entries(sources).map(([name, source]) => {
    const row = document.createElement("tr");
    const well = source.state === "ok" || source.state === "starting" || source.state === "ended";
    row.className = !known ? "old" : well ? "" : "bad";
    row.dataset.source = name;
    row.dataset.state = known ? source.state : "unknown";
    row.append(cell(kNames[name] ?? name), cell(known ? `${kMarks[source.state] ?? "\u2715"} ${source.state}` : "? not known"),
               cell(known ? `${figure(source.rate_hz)} Hz` : ""),
               cell(known ? `${figure(source.delay_p50_ms)}, ${figure(source.delay_p99_ms)} ms` : ""));
    return row;
  }));
}

// A list of {text, bad}.
export function factsOf(status) {
  const facts = [
    {text: `rhythm ${status.rhythm.replaceAll("_", " ")}, phase ${status.phase.replaceAll("_", " ")}, breathing ${status.respiration}`},
    {text: `set-up ${status.setup.words}`, bad: status.setup.doubted},
    {text: `recording ${status.recording}`, bad: status.recording === "stopped"},
    {text: `features: ${status.features_converged} converged, ${status.features_converging} converging, ` +
           `${status.features_tracked + status.features_starting} new`},
  ];
  if (status.latency_short) facts.push({text: "pipeline.latency_ms is too short for these sources", bad: true});
  if (status.releases_missed > 0) facts.push({text: `${status.releases_missed} releases missed`, bad: true});
  if (status.features_shed > 0) facts.push({text: `${status.features_shed === 1 ? "1 feature" : `${status.features_shed} features`} not looked for: too little computing time`, bad: true});
  status.ecg_leads.forEach((lead, i) => {
    if (lead === "flat" || lead === "off" || lead === "noisy") {
      facts.push({text: `${i ? "second" : "first"} lead of the ECG ${lead}`, bad: true});
    }
  });
  if (status.scope_turn === "changed") facts.push({text: "the scope has been turned or zoomed", bad: true});
  return facts;
}

export function showFacts(list, status) {
  list.replaceChildren(...factsOf(status).sort((a, b) => Boolean(b.bad) - Boolean(a.bad)).map(({text, bad}) => {
    const item = document.createElement("li");
    item.textContent = text;
    item.className = bad ? "bad" : "";
    return item;
  }));
}
