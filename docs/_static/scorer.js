// What the search of the site shows and in which order: headings that contain the words, then pages by how often they
// contain them; pages that explain first, pages made from code last. Beside each page stands its text at the first of
// these places. docs/_ext/texts.py writes TEXTS.
const WORDS = (new URLSearchParams(location.search).get("q") || "").toLowerCase().split(/\s+/).filter(Boolean);
const AROUND = 80; // characters before and after the word
const FIRST = [
  [/^(explanation|tutorial)/, 3], [/^explanation\/physics/, 4],
  [/^(reference\/generated\/(tables|commands|shipped)|reference\/python|gallery|figures|engine-reports)/, -25],
];

function places(text) {
  const found = WORDS.map((word) => text.toLowerCase().split(word).length - 1);
  return found.length ? Math.min(...found) : 0;
}

function excerpt(text) {
  const at = text.toLowerCase().indexOf(WORDS[0]);
  if (at < 0) return null;
  const [from, to] = [Math.max(0, at - AROUND), Math.min(text.length, at + AROUND)];
  return `${from ? "…" : ""}${text.slice(from, to).trim()}${to < text.length ? "…" : ""}`;
}

var Scorer = {
  score: (result) => {
    const [name, title, anchor, description, score, , kind] = result;
    const text = TEXTS[name] || "";
    const named = WORDS.every((word) => title.toLowerCase().includes(word)) ? 10 : 0; // of a page about all of them
    const prior = FIRST.filter(([pages]) => pages.test(name)).reduce((sum, [, more]) => sum + more, named);
    if (kind === "title") return (anchor ? 20 : 25) + score + prior;
    if (kind !== "text") return score + prior;
    if (!description) result[3] = excerpt(text);
    return 5 * (1 - Math.exp(-places(text) / 10)) + score + prior;
  },
  objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
