// node sbom_check.js SBOM PROGRAM...: what is wrong with an SPDX 2.3 document, one fault a line; exit code 1 then.
// Required are the fields that https://spdx.github.io/spdx-spec/v2.3 requires, references that lead somewhere, and that
// each shared library that a PROGRAM names as needed is of one of the packages.
// node sbom_check.js --faults SBOM PROGRAM...: whether faults made in the document are told.
"use strict";
const fs = require("fs");
const { execFileSync } = require("child_process");

const kinds = ["DESCRIBES", "DYNAMIC_LINK", "STATIC_LINK", "DEPENDS_ON", "BUILD_DEPENDENCY_OF", "BUILD_TOOL_OF",
  "CONTAINS"];
const purposes = ["APPLICATION", "FRAMEWORK", "LIBRARY", "CONTAINER", "OPERATING-SYSTEM", "DEVICE", "FIRMWARE",
  "SOURCE", "ARCHIVE", "FILE", "INSTALL", "OTHER"];
const filled = ["name", "versionInfo", "downloadLocation", "copyrightText"];
const purl = /^pkg:deb\/debian\/[a-z0-9.%+-]+@[A-Za-z0-9.~%_-]+\?arch=[a-z0-9-]+$/i;
const text = (value) => typeof value === "string" && value !== "";
const id = (value) => /^SPDXRef-[A-Za-z0-9.-]+$/.test(value);

function documentFaults(sbom) {
  const faults = [];
  const asked = (field, holds) => holds || faults.push(`${field} is missing or wrong: ${JSON.stringify(sbom[field])}`);
  asked("spdxVersion", sbom.spdxVersion === "SPDX-2.3");
  asked("dataLicense", sbom.dataLicense === "CC0-1.0");
  asked("SPDXID", sbom.SPDXID === "SPDXRef-DOCUMENT");
  asked("name", text(sbom.name));
  asked("documentNamespace", /^https?:\/\/[^#\s]+$/.test(sbom.documentNamespace));
  const creation = sbom.creationInfo ?? {};
  asked("creationInfo", /^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$/.test(creation.created) && creation.creators?.length > 0 &&
    creation.creators.every((who) => /^(Tool|Person|Organization): ./.test(who)));
  asked("packages", sbom.packages?.length > 1);
  asked("relationships", sbom.relationships?.length > 1);
  return faults;
}

// Of a licence expression: words, AND, OR; each LicenseRef is explained.
function licenseFault(expression, explained) {
  if (expression === "NOASSERTION" || expression === "NONE") return "";
  const words = String(expression).split(" ");
  for (const [i, word] of words.entries()) {
    if (i % 2 === 1 ? !/^(AND|OR)$/.test(word) : !/^[A-Za-z0-9.-]+$/.test(word)) return `'${expression}' is no licence`;
    if (word.startsWith("LicenseRef-") && !explained.has(word)) return `${word} is explained nowhere`;
  }
  return words.length % 2 === 1 ? "" : `'${expression}' is no licence`;
}

function packageFaults(sbom) {
  const faults = [];
  const explained = new Set();
  for (const license of sbom.hasExtractedLicensingInfos ?? []) {
    explained.add(license.licenseId);
    if (!/^LicenseRef-[A-Za-z0-9.-]+$/.test(license.licenseId) || !text(license.extractedText))
      faults.push(`a licence without name or text: ${JSON.stringify(license)}`);
  }
  const ids = new Set();
  for (const p of sbom.packages ?? []) {
    const wrong = (what) => faults.push(`${p.name}: ${what}`);
    if (!id(p.SPDXID) || ids.has(p.SPDXID)) wrong(`SPDXID ${p.SPDXID}`);
    ids.add(p.SPDXID);
    for (const field of filled) if (!text(p[field])) wrong(`no ${field}`);
    if (p.filesAnalyzed !== false) wrong("filesAnalyzed");
    for (const field of ["licenseConcluded", "licenseDeclared"]) {
      const fault = licenseFault(p[field], explained);
      if (fault) wrong(fault);
    }
    if (p.supplier !== "NOASSERTION" && !/^(Person|Organization): ./.test(p.supplier)) wrong(`supplier ${p.supplier}`);
    const purpose = p.primaryPackagePurpose;
    if (purpose && !purposes.includes(purpose)) wrong(`purpose ${purpose}`);
    for (const r of p.externalRefs ?? [])
      if (r.referenceCategory !== "PACKAGE-MANAGER" || r.referenceType !== "purl" || !purl.test(r.referenceLocator))
        wrong(`reference ${r.referenceLocator}`);
  }
  return faults;
}

function relationshipFaults(sbom) {
  const faults = [];
  const ids = new Set(["SPDXRef-DOCUMENT", ...(sbom.packages ?? []).map((p) => p.SPDXID)]);
  const related = new Set();
  for (const r of sbom.relationships ?? []) {
    if (!kinds.includes(r.relationshipType)) faults.push(`a relationship of the kind ${r.relationshipType}`);
    for (const end of [r.spdxElementId, r.relatedSpdxElement]) {
      if (!ids.has(end)) faults.push(`a relationship with ${end}, which is not there`);
      related.add(end);
    }
  }
  for (const one of ids) if (!related.has(one)) faults.push(`${one} is related to nothing`);
  return faults;
}

function libraryFaults(sbom, programs) {
  const listed = new Set((sbom.relationships ?? []).filter((r) => r.relationshipType === "DYNAMIC_LINK")
    .flatMap((r) => r.comment.split(" ")));
  const faults = [];
  for (const program of programs) {
    const dynamic = execFileSync("readelf", ["-d", program], { encoding: "utf8" });
    const needed = [...dynamic.matchAll(/\(NEEDED\).*\[(.*)\]/g)];
    if (needed.length < 5) faults.push(`${program} needs ${needed.length} libraries?`);
    for (const [, library] of needed)
      if (!listed.has(library)) faults.push(`${program} needs ${library}, which is not there`);
  }
  return faults;
}

const faultsOf = (sbom, programs) =>
  [...documentFaults(sbom), ...packageFaults(sbom), ...relationshipFaults(sbom), ...libraryFaults(sbom, programs)];

const [first, ...rest] = process.argv.slice(2);
if (first !== "--faults") {
  const faults = faultsOf(JSON.parse(fs.readFileSync(first, "utf8")), rest);
  for (const fault of faults) console.log(fault);
  process.exit(faults.length > 0 ? 1 : 0);
}

const [file, ...programs] = rest;
const whole = fs.readFileSync(file, "utf8");
const made = {
  "no spdxVersion": (s) => delete s.spdxVersion,
  "no namespace": (s) => delete s.documentNamespace,
  "no creator": (s) => (s.creationInfo.creators = []),
  "no version of a package": (s) => delete s.packages[1].versionInfo,
  "two packages of one name": (s) => s.packages.push(s.packages[1]),
  "a licence that is none": (s) => (s.packages[1].licenseDeclared = "GPL-2+ with something"),
  "a licence that is explained nowhere": (s) => (s.packages[1].licenseDeclared = "LicenseRef-debian-secret"),
  "a relationship that leads nowhere": (s) => (s.relationships[1].relatedSpdxElement = "SPDXRef-Package-none"),
  "a library left out": (s) => (s.relationships = s.relationships.filter((r) => !/libddsc/.test(r.comment ?? ""))),
};
for (const [what, make] of Object.entries(made)) {
  const sbom = JSON.parse(whole);
  make(sbom);
  if (faultsOf(sbom, programs).length === 0) {
    console.log(`not told: ${what}`);
    process.exit(1);
  }
}
console.log(`${Object.keys(made).length} faults are told`);
