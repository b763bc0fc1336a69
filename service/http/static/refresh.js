"use strict";
// Shows what is new on a page, and does not move what a person reads. Where nothing is new the server answers 304.

const EVERY = 30e3; // ms
const PLACES = "h2, h3, tr, li, p, figure";

const content = document.querySelector("main[data-refresh]");
let known = content?.innerHTML; // before other scripts change it
let lookedAt = Date.now();

async function refresh() {
  lookedAt = Date.now();
  if (content.querySelector("[data-follow]") !== null) return; // progress.js follows it
  const answer = await fetch(location.href, { headers: { "Menshin-Refresh": "1" }, credentials: "same-origin" });
  if (!answer.ok || answer.redirected) return;
  const fresh = new DOMParser().parseFromString(await answer.text(), "text/html").querySelector("main");
  if (fresh === null || fresh.innerHTML === known) return;
  if (isInUse()) announce(fresh);
  else show(fresh);
}

function isInUse() {
  const isTyping = content.contains(document.activeElement) && document.activeElement.matches("input, select, textarea");
  return isTyping || !getSelection().isCollapsed || [...document.forms].some((form) => [...form.elements].some(isChanged));
}

function isChanged(field) {
  if (field.type === "checkbox" || field.type === "radio") return field.checked !== field.defaultChecked;
  if (field.tagName === "SELECT") return [...field.options].some((one) => one.defaultSelected && !one.selected);
  return field.defaultValue !== undefined && field.value !== field.defaultValue;
}

function announce(fresh) {
  document.querySelector(".news")?.remove();
  const line = document.createElement("p");
  const button = document.createElement("button");
  line.className = "news";
  line.setAttribute("role", "status");
  button.type = "button";
  button.textContent = inWords("Show what is new"); // of theme.js
  button.addEventListener("click", () => show(fresh));
  line.append(`${inWords("This page has changed.")} `, button);
  document.body.append(line);
}

function show(fresh) {
  const seen = place();
  const opened = [...content.querySelectorAll("details[open] > summary")].map((one) => one.textContent);
  known = fresh.innerHTML;
  content.replaceChildren(...fresh.childNodes);
  for (const summary of content.querySelectorAll("details > summary")) {
    if (opened.includes(summary.textContent)) summary.parentElement.open = true;
  }
  if (seen !== undefined) {
    const same = [...content.querySelectorAll(PLACES)].find((one) => identity(one) === seen.identity);
    if (same !== undefined) scrollBy({ top: same.getBoundingClientRect().top - seen.top, behavior: "instant" });
  }
  document.querySelector(".news")?.remove();
  if (typeof follow === "function") follow(); // of progress.js
}

// What stands first on the screen, unless the top of the page does.
function place() {
  if (scrollY === 0) return undefined;
  const first = [...content.querySelectorAll(PLACES)].find((one) => one.getBoundingClientRect().top >= 0);
  return first && { identity: identity(first), top: first.getBoundingClientRect().top };
}

function identity(element) {
  return element.tagName + (element.dataset.chart ?? element.textContent);
}

if (content !== null) {
  setInterval(() => document.hidden || refresh(), EVERY);
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden && Date.now() - lookedAt > EVERY) refresh();
  });
}
