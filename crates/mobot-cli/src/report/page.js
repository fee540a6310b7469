"use strict";
// one time for everything on the page: a slider moves the robot on the map, the cursors on the charts, and
// marks the frame and the event of that time
const run = JSON.parse(document.getElementById("run").textContent);
const ns = "http://www.w3.org/2000/svg";
const slider = document.getElementById("time"), says = document.getElementById("says");
const map = document.querySelector(".map svg .map");
const make = (kind, attributes, parent) => {
  const made = document.createElementNS(ns, kind);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
};
const robot = (color) => {
  const group = make("g", {}, map);
  make("circle", { r: run.radius, fill: color, "fill-opacity": .25, stroke: color, "stroke-width": 2, "vector-effect": "non-scaling-stroke" }, group);
  make("path", { d: `M0 0H${run.radius}`, stroke: color, "stroke-width": 2, "vector-effect": "non-scaling-stroke" }, group);
  return group;
};
const bodies = map && run.t.length ? { odometry: robot("#c8500a"), truth: robot("#1e1e22"), estimate: robot("#0058c4") } : {};
const cursors = [...document.querySelectorAll(".chart[data-from]")].map((chart) => {
  const [from, to, left, right, top, bottom] = ["from", "to", "left", "right", "top", "bottom"].map((key) => Number(chart.dataset[key]));
  const line = make("line", { class: "cursor", y1: top, y2: bottom }, chart);
  return (t) => { const x = left + (right - left) * (t - from) / (to - from); line.setAttribute("x1", x); line.setAttribute("x2", x); };
});
const last = (times, t) => { let low = 0, high = times.length; while (low < high) { const mid = (low + high) >> 1; if (times[mid] <= t) low = mid + 1; else high = mid; } return low - 1; };
const timed = (selector) => { const all = [...document.querySelectorAll(selector)]; return { all, times: all.map((one) => Number(one.dataset.t)) }; };
const frames = timed("figure[data-t]"), events = timed(".events tr[data-t]");
const mark = ({ all, times }, t) => { const now = last(times, t); all.forEach((one, i) => one.classList.toggle("now", i === now)); return all[now]; };
const cm = (metres) => `${(100 * metres).toFixed(1)} cm`;
const show = () => {
  const t = Number(slider.value), i = Math.max(0, last(run.t, t));
  for (const [name, body] of Object.entries(bodies)) {
    const [x, y, turn] = run[name][i];
    body.setAttribute("transform", `translate(${x} ${y}) rotate(${turn})`);
  }
  cursors.forEach((move) => move(t));
  mark(frames, t);
  const event = mark(events, t);
  if (event) event.parentElement.parentElement.parentElement.scrollTop = event.offsetTop - 80;
  const error = run.error[i];
  says.textContent = `${t.toFixed(1)} s` + (error === null ? "" : `: error ${cm(error)}, 95 % bound ${cm(run.bound[i])}, odometry alone ${cm(run.drift[i])}`);
};
slider.addEventListener("input", show);
document.querySelectorAll(".chart[data-from]").forEach((chart) => chart.addEventListener("click", (click) => {
  const box = chart.getBoundingClientRect(), view = chart.viewBox.baseVal, d = chart.dataset;
  const x = (click.clientX - box.left) * view.width / box.width;
  slider.value = Number(d.from) + (Number(d.to) - Number(d.from)) * (x - d.left) / (d.right - d.left);
  show();
}));
document.querySelectorAll("figure[data-t]").forEach((figure) => figure.addEventListener("click", () => { slider.value = figure.dataset.t; show(); }));
document.querySelectorAll("input[data-layer]").forEach((box) => box.addEventListener("change", () => {
  document.querySelectorAll(`.map svg .${box.dataset.layer}`).forEach((line) => { line.style.display = box.checked ? "" : "none"; });
}));
show();
