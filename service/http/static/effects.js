"use strict";
// Sliders beside the values of an effect: while one moves, the chart shows the loop at the new values. The fields
// themselves are what counts, and the form works without this script.

const PAUSE = 60; // ms without movement before the server is asked

const form = document.getElementById("values");
const figure = document.querySelector("figure[data-chart^='/charts/effect.']");
let waiting;
let asked = 0;

function valueAt(slider) {
  const [low, high] = [Number(slider.dataset.low), Number(slider.dataset.high)];
  const share = Number(slider.value) / Number(slider.max);
  return "log" in slider.dataset ? low * (high / low) ** share : low + (high - low) * share;
}

function placeSlider(slider) {
  const [low, high] = [Number(slider.dataset.low), Number(slider.dataset.high)];
  const value = Number(document.getElementById(slider.dataset.of).value);
  const share = "log" in slider.dataset ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  slider.value = Math.round(Number(slider.max) * Math.min(1, Math.max(0, share || 0)));
  slider.setAttribute("aria-valuetext", document.getElementById(slider.dataset.of).value);
}

async function showLoop() {
  const query = new URLSearchParams(new FormData(form));
  history.replaceState(null, "", `?${query}`);
  query.set("name", location.pathname.split("/").pop());
  const address = `/charts/effect.json?${query}`;
  const number = (asked += 1);
  const answer = await fetch(address, { credentials: "same-origin" });
  if (!answer.ok || number !== asked) return;
  const spec = await answer.json();
  figure.dataset.chart = address;
  figure.querySelector("img").src = `/charts/effect.svg?${query}`; // for paper
  for (const link of figure.querySelectorAll("figcaption a")) link.href = `/charts/effect.html?${query}`;
  const chart = charts.find((one) => one.figure === figure); // of charts.js
  if (chart === undefined) return; // it is drawn at this address as soon as it is near
  chart.spec = spec;
  await chart.draw();
}

function soon() {
  clearTimeout(waiting);
  waiting = setTimeout(showLoop, PAUSE);
}

for (const slider of form.querySelectorAll("input[type=range]")) {
  placeSlider(slider);
  slider.hidden = false;
  const field = document.getElementById(slider.dataset.of);
  slider.addEventListener("input", () => {
    field.value = Number(valueAt(slider).toPrecision(4));
    slider.setAttribute("aria-valuetext", field.value);
    soon();
  });
  field.addEventListener("input", () => {
    placeSlider(slider);
    soon();
  });
}
