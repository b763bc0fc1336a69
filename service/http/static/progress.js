"use strict";
// Follows what is under way by server-sent events. Only the parts of a page that are marked data-live are ever replaced:
// what a person has typed or ticked elsewhere on it stays. A page with data-leads gives way to the result.

const UNDER_WAY = ["waiting", "running"];

function follow() {
  const part = document.querySelector("[data-follow]");
  if (part === null) return;
  for (const line of part.querySelectorAll(".refresh")) line.hidden = true;
  const stream = new EventSource(part.dataset.follow);
  let isFirst = true;
  stream.onmessage = (message) => {
    const told = JSON.parse(message.data);
    if (UNDER_WAY.includes(told.state)) {
      showProgress(part, told);
    } else if (told.state !== undefined) {
      stream.close(); // it has ended
      renew().then(follow);
    } else if (!isFirst) {
      renew();
    }
    isFirst = false;
  };
  stream.onerror = () => {
    if (stream.readyState !== EventSource.CLOSED) return; // the browser asks again by itself
    for (const line of part.querySelectorAll(".refresh")) line.hidden = false;
  };
}

function showProgress(part, job) {
  const bar = part.querySelector("progress");
  if (bar === null) return;
  const row = bar.closest("tr");
  const state = row.querySelector(".state");
  state.textContent = state.dataset[job.state];
  if (job.progress === null) return;
  bar.max = 1;
  bar.value = job.progress.share;
  row.querySelector(".doing").textContent = job.progress.doing;
}

async function renew() {
  const answer = await fetch(location.href, { credentials: "same-origin" });
  if (answer.ok && answer.redirected && document.querySelector("[data-leads]") !== null) location.replace(answer.url);
  if (!answer.ok || answer.redirected) return;
  const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
  for (const part of document.querySelectorAll("[data-live]")) {
    const other = fresh.getElementById(part.id);
    if (other === null) continue;
    part.replaceChildren(...other.childNodes);
    if (other.dataset.follow === undefined) delete part.dataset.follow;
    else part.dataset.follow = other.dataset.follow;
  }
}

follow();
