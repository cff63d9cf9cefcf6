"use strict";
// Draws what depends on what is chosen. The data are columns: one entry per case in each list.

const STATES = ["passes", "violates", "stopped"];
const STATE_COLOURS = ["#1b8a5a", "#c8501e", "#7a3e9d"];
// Okabe and Ito: told apart with any kind of colour vision.
const COLOURS = ["#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#999999", "#F0E442"];
const ROWS_OF_PAGE = 25;
const BINS = 5;
const MOST_POINTS = 3000;

const byId = (id) => document.getElementById(id);

async function unpacked(id) {
  const packed = Uint8Array.from(atob(byId(id).textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
}

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function number(value) {
  if (value === null || value === undefined) return "";
  if (!Number.isFinite(value)) return "∞";
  return String(Number(value.toPrecision(3)));
}

function fill(select, choices, chosen) {
  select.replaceChildren(...choices.map(([value, text]) => element("option", { value, textContent: text })));
  if (choices.some(([value]) => value === chosen)) select.value = chosen;
}

// An axis in levels, which a table can have as rows: a range is cut into intervals.
function inLevels(axis) {
  if (!axis.range) return axis;
  const scale = axis.log ? Math.log : (x) => x;
  const back = axis.log ? Math.exp : (x) => x;
  const [low, high] = axis.range.map(scale);
  const edges = Array.from({ length: BINS + 1 }, (_, k) => back(low + (k * (high - low)) / BINS));
  const levels = edges.slice(1).map((edge, k) => `${number(edges[k])} to ${number(edge)}`);
  const at = axis.at.map((v) => (v === null ? null :
    Math.min(BINS - 1, Math.max(0, Math.floor((BINS * (scale(v) - low)) / (high - low))))));
  return { ...axis, levels, at };
}

class Report {
  constructor(data) {
    this.data = data;
    this.count = data.state.length;
    this.axes = data.axes;
    this.all = Array.from({ length: this.count }, (_, k) => k);
    this.cell = null;
    this.sort = { column: 0, down: false };
    this.page = 0;
    this.setUp();
    this.drawMatrix();
    this.drawChosen();
  }

  setUp() {
    const names = this.axes.map((axis, k) => [String(k), axis.title]);
    const none = [["", "–"]];
    fill(byId("matrix-rows"), none.concat(names), "0");
    fill(byId("matrix-columns"), none.concat(names), names.length > 1 ? "1" : "");
    fill(byId("plot-clause"), this.data.clauses.map((c, k) => [String(k), `${c.text} ${c.limit}`]), "0");
    const over = this.axes.findIndex((axis) => axis.range);
    fill(byId("plot-axis"), names, String(Math.max(over, 0)));
    const groups = names.filter(([k]) => !this.axes[k].range && this.axes[k].levels.length <= COLOURS.length);
    // Seeds are only told apart when somebody asks.
    const group = groups.find(([k]) => k !== byId("plot-axis").value && Number(k) < names.length - 1);
    fill(byId("plot-group"), [["", "verdict"]].concat(groups), group ? group[0] : "");
    byId("distributions").hidden = this.data.clauses.length === 0;
    for (const id of ["matrix-rows", "matrix-columns", "matrix-shows"]) {
      byId(id).addEventListener("change", () => { this.cell = null; this.drawMatrix(); this.drawChosen(); });
    }
    for (const id of ["plot-clause", "plot-axis", "plot-group", "plot-kind", "plot-log"]) {
      byId(id).addEventListener("change", () => this.drawPlot());
    }
    byId("chosen-clear").addEventListener("click", () => this.choose(null));
    byId("cases-state").addEventListener("change", () => { this.page = 0; this.drawCases(); });
    byId("cases-before").addEventListener("click", () => { this.page -= 1; this.drawCases(); });
    byId("cases-after").addEventListener("click", () => { this.page += 1; this.drawCases(); });
  }

  // Cases of the chosen cell, or all.
  chosen() {
    return this.cell === null ? this.all : this.cell.cases;
  }

  choose(cell) {
    this.cell = cell;
    this.drawMatrix();
    this.drawChosen();
  }

  axisOf(id) {
    const value = byId(id).value;
    return value === "" ? null : inLevels(this.axes[Number(value)]);
  }

  drawMatrix() {
    const rows = this.axisOf("matrix-rows");
    const columns = this.axisOf("matrix-columns");
    const levels = (axis) => (axis ? [...axis.levels.keys()] : []);
    const is = (axis, level, k) => level === null || axis.at[k] === level;
    const heading = [rows ? rows.title : "", columns ? columns.title : ""].filter(Boolean).join(" \\ ");
    const head = element("tr", {}, element("th", { textContent: heading }));
    for (const column of levels(columns)) head.append(element("th", { textContent: columns.levels[column] }));
    head.append(element("th", { textContent: "all" }));
    const body = [...levels(rows), null].map((row) => {
      const line = element("tr", {}, element("th", { textContent: row === null ? "all" : rows.levels[row] }));
      for (const column of [...levels(columns), null]) {
        const cases = this.all.filter((k) => is(rows, row, k) && is(columns, column, k));
        const words = [[rows, row], [columns, column]].filter(([, level]) => level !== null)
          .map(([axis, level]) => `${axis.title} = ${axis.levels[level]}`);
        line.append(this.matrixCell(`${row} ${column}`, cases, words.join(" and ")));
      }
      return line;
    });
    byId("matrix-table").replaceChildren(element("thead", {}, head), element("tbody", {}, ...body));
  }

  matrixCell(id, cases, words) {
    const cell = element("td");
    if (cases.length === 0) return cell;
    const passing = cases.filter((k) => this.data.state[k] === 0).length;
    const used = Math.max(...cases.map((k) => this.data.used[k] ?? Infinity));
    const shows = byId("matrix-shows").value;
    const bad = shows === "passed" ? 1 - passing / cases.length : used <= 1 ? 0 : Math.min(1, Math.log2(used) / 3);
    const holds = shows === "passed" ? bad === 0 : used <= 1;
    // Green only where everything holds; light enough for dark words.
    const [hue, strength] = holds ? ["27,138,90", 0.42] : ["213,94,0", 0.18 + 0.42 * bad];
    if (words) cell.style.background = `rgba(${hue},${strength})`;
    else cell.className = "total";
    const pressed = this.cell !== null && this.cell.id === id;
    cell.append(element("button", {
      textContent: shows === "passed" ? `${passing} / ${cases.length}` : number(used),
      title: `${words || "all cases"}: ${passing} of ${cases.length} pass; ` +
        (Number.isFinite(used) ? `at most ${number(used)} times a limit is used` : "some have no number"),
      onclick: () => this.choose(pressed || !words ? null : { id, cases, words }),
      ariaPressed: String(pressed),
    }));
    return cell;
  }

  drawChosen() {
    byId("chosen").hidden = this.cell === null;
    if (this.cell !== null) {
      byId("chosen-text").textContent = `Below: ${this.cell.cases.length} cases with ${this.cell.words}`;
    }
    this.page = 0;
    this.drawPlot();
    this.drawClauses();
    this.drawCases();
  }

  // Lists of cases that are drawn in one colour.
  groups(clause) {
    const cases = this.chosen().filter((k) => clause.measured[k] !== null);
    const axis = this.axisOf("plot-group");
    if (axis === null) {
      const out = new Set(clause.violated);
      const parts = [cases.filter((k) => !out.has(k)), cases.filter((k) => out.has(k))];
      return parts.map((own, k) => ({ name: ["holds", "violated"][k], colour: STATE_COLOURS[k], cases: own }))
        .filter((group) => group.cases.length > 0);
    }
    return axis.levels.map((level, k) => ({
      name: String(level), colour: COLOURS[k], cases: cases.filter((c) => axis.at[c] === k),
    })).filter((group) => group.cases.length > 0);
  }

  drawPlot() {
    if (this.data.clauses.length === 0) return;
    const clause = this.data.clauses[Number(byId("plot-clause").value)];
    const cumulative = byId("plot-kind").value === "cumulative";
    const log = byId("plot-log").checked;
    const groups = this.groups(clause);
    const value = { title: { standoff: 8, text: clause.unit ? `${clause.text} [${clause.unit}]` : clause.text }, gridcolor: "#eef1f5",
      type: log ? "log" : "linear", rangemode: log ? "normal" : "tozero", zeroline: false };
    const traces = groups.map((g) => (cumulative ? this.cumulative(g, clause) : this.spread(g, clause, groups)));
    const axis = this.axes[Number(byId("plot-axis").value)];
    const other = cumulative
      ? { title: { text: "share of the cases [%]", standoff: 8 }, range: [0, 101], gridcolor: "#eef1f5" }
      : { title: { text: axis.title, standoff: 8 }, gridcolor: "#eef1f5",
        ...(axis.range ? { type: axis.log ? "log" : "linear", dtick: axis.log ? "D2" : undefined } : { type: "category",
          categoryorder: "array", categoryarray: axis.levels.map(String) }) };
    const lines = clause.bounds.filter(Number.isFinite);
    const layout = {
      font: { family: "system-ui, 'Segoe UI', Helvetica, Arial, sans-serif", size: 12.5, color: "#26324a" },
      margin: { l: 70, r: 20, t: 34, b: 48 }, boxmode: "group", hovermode: "closest", paper_bgcolor: "#fff",
      showlegend: true, legend: { orientation: "h", y: 1.11, x: 0, yanchor: "top" },
      xaxis: { automargin: true, ...(cumulative ? value : other) },
      yaxis: { automargin: true, ...(cumulative ? other : value) },
      shapes: lines.map((at) => ({ type: "line", line: { color: "#c8501e", width: 1.5, dash: "dash" },
        ...(cumulative ? { x0: at, x1: at, yref: "paper", y0: 0, y1: 1 }
          : { y0: at, y1: at, xref: "paper", x0: 0, x1: 1 }) })),
      annotations: lines.map((at) => ({ text: `limit ${number(at)}`, showarrow: false, font: { color: "#c8501e" },
        bgcolor: "rgba(255,255,255,0.8)",
        ...(cumulative ? { x: log ? Math.log10(at) : at, yref: "paper", y: 0.02, xanchor: "left", yanchor: "bottom" }
          : { y: log ? Math.log10(at) : at, xref: "paper", x: 1, xanchor: "right", yanchor: "bottom" }) })),
    };
    Plotly.react("plot", traces, layout, { responsive: true, displaylogo: false,
      modeBarButtonsToRemove: ["select2d", "lasso2d"],
      toImageButtonOptions: { filename: `${this.data.name}-${clause.text}`, scale: 2 } });
  }

  spread(group, clause, groups) {
    const axis = this.axes[Number(byId("plot-axis").value)];
    const y = group.cases.map((k) => clause.measured[k]);
    const x = group.cases.map((k) => (axis.range ? axis.at[k] : String(axis.levels[axis.at[k]])));
    const common = { name: group.name, x, y, text: group.cases.map((k) => this.data.label[k]),
      hovertemplate: "%{y:.4g}<br>%{text}<extra></extra>" };
    const marker = { color: group.colour, size: groups.length > 1 || y.length < 300 ? 6 : 5, opacity: 0.75 };
    if (axis.range) return { ...common, type: y.length > MOST_POINTS ? "scattergl" : "scatter", mode: "markers", marker };
    return { ...common, type: "box", marker: { ...marker, size: 4, opacity: 0.55 }, line: { width: 1.5 },
      boxpoints: y.length > MOST_POINTS ? "suspectedoutliers" : "all", jitter: 0.5, pointpos: 0,
      fillcolor: "rgba(255,255,255,0)" };
  }

  cumulative(group, clause) {
    const cases = group.cases.slice().sort((a, b) => clause.measured[a] - clause.measured[b]);
    const steps = [cases[0], ...cases];
    return { name: group.name, type: "scatter", mode: "lines", line: { color: group.colour, shape: "hv", width: 2 },
      cliponaxis: false, x: steps.map((k) => clause.measured[k]), y: steps.map((_, k) => (100 * k) / cases.length),
      text: steps.map((k) => this.data.label[k]), hovertemplate: "%{x:.4g}, %{y:.0f} %<br>%{text}<extra></extra>" };
  }

  drawClauses() {
    const head = ["expectation", "limit", "median", "95 %", "largest", "violated"];
    const cases = this.chosen();
    const rows = this.data.clauses.map((clause) => {
      const values = cases.map((k) => clause.measured[k]).filter((v) => v !== null).sort((a, b) => a - b);
      const part = (share) => (values.length ? values[Math.min(values.length - 1, Math.floor(share * values.length))] : null);
      const own = new Set(clause.violated);
      const violated = cases.filter((k) => own.has(k)).length;
      const shown = (v) => (v === null ? "" : `${number(v)} ${clause.unit}`);
      return element("tr", {}, element("td", { textContent: clause.text }),
        ...[clause.limit, shown(part(0.5)), shown(part(0.95)), shown(part(1)), String(violated)]
          .map((text, k) => element("td", { className: k === 4 && violated ? "n over" : "n", textContent: text })));
    });
    byId("clause-table").replaceChildren(
      element("thead", {}, element("tr", {}, ...head.map((text, k) => element("th", { textContent: text, className: k ? "n" : "" })))),
      element("tbody", {}, ...rows));
  }

  // Title, value to sort by and text of each column of the list of cases.
  columns() {
    const data = this.data;
    const out = data.clauses.map((clause) => new Set(clause.violated));
    return [
      { title: "verdict", value: (k) => -data.state[k], cell: (k) => element("td", {},
        element("span", { className: `mark s${data.state[k]}`, textContent: STATES[data.state[k]] })) },
      ...this.axes.map((axis) => ({ title: axis.title, value: (k) => axis.at[k] ?? -1, cell: (k) => element("td", {
        textContent: axis.at[k] === null ? "" : axis.range ? number(axis.at[k]) : String(axis.levels[axis.at[k]]),
        className: axis.range ? "n" : "" }), right: Boolean(axis.range) })),
      ...data.clauses.map((clause, c) => ({ title: `${clause.text}${clause.unit ? ` [${clause.unit}]` : ""}`, right: true,
        value: (k) => clause.measured[k] ?? -Infinity, cell: (k) => element("td", {
          textContent: number(clause.measured[k]), className: out[c].has(k) ? "n over" : "n" }) })),
      { title: "of limit", right: true, value: (k) => data.used[k] ?? Infinity, cell: (k) => element("td", {
        className: "n", textContent: data.state[k] === 2 ? "" : number(data.used[k] ?? Infinity) }) },
      ...(data.failures.length ? [{ title: "stopped because", value: (k) => data.failure[k], cell: (k) => element("td", {
        className: "why", textContent: data.failure[k] < 0 ? "" : data.failures[data.failure[k]] }) }] : []),
    ];
  }

  drawCases() {
    const columns = this.columns();
    const state = byId("cases-state").value;
    const cases = this.chosen().filter((k) => state === "" || this.data.state[k] === Number(state));
    const { column, down } = this.sort;
    const value = columns[column].value;
    cases.sort((a, b) => (value(a) - value(b)) * (down ? -1 : 1) || (this.data.used[b] ?? Infinity) - (this.data.used[a] ?? Infinity) || a - b);
    const pages = Math.max(1, Math.ceil(cases.length / ROWS_OF_PAGE));
    this.page = Math.min(Math.max(this.page, 0), pages - 1);
    const first = this.page * ROWS_OF_PAGE;
    const shown = cases.slice(first, first + ROWS_OF_PAGE);
    const head = columns.map((c, k) => {
      const made = element("th", { textContent: c.title, className: c.right ? "n" : "", onclick: () => {
        this.sort = { column: k, down: column === k && !down };
        this.page = 0;
        this.drawCases();
      } });
      if (k === column) made.ariaSort = down ? "descending" : "ascending";
      return made;
    });
    const table = byId("cases-table");
    table.tHead.replaceChildren(element("tr", {}, ...head));
    table.tBodies[0].replaceChildren(...shown.map((k) => element("tr", {}, ...columns.map((c) => c.cell(k)))));
    byId("cases-range").textContent = cases.length
      ? `${first + 1} to ${first + shown.length} of ${cases.length}` : "none";
    byId("cases-before").disabled = this.page === 0;
    byId("cases-after").disabled = this.page === pages - 1;
  }
}

(async () => {
  if (typeof DecompressionStream === "undefined") {
    document.body.prepend(element("p", { textContent: "This report needs a browser of 2023 or later." }));
    return;
  }
  document.head.append(element("script", { textContent: await unpacked("packed-plotly") }));
  window.report = new Report(JSON.parse(await unpacked("packed-data")));
  document.body.dataset.ready = "true";
})();
