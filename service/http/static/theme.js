"use strict";
// The theme that a person chose in this browser, set before anything is drawn; until then the system's theme applies.

const KEY = "menshin-theme";
const IN_LANGUAGE = JSON.parse(document.currentScript.dataset.words ?? "{}"); // of the page's language, by the English ones

function inWords(english) { // for all scripts of a page
  return IN_LANGUAGE[english] ?? english;
}

function systemTheme() {
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

function theme() {
  return document.documentElement.dataset.theme ?? systemTheme();
}

function choose(wanted) {
  if (wanted === systemTheme()) {
    localStorage.removeItem(KEY);
    delete document.documentElement.dataset.theme;
  } else {
    localStorage.setItem(KEY, wanted);
    document.documentElement.dataset.theme = wanted;
  }
  document.dispatchEvent(new Event("themechange"));
}

function addSwitch() {
  const button = document.createElement("button");
  const label = () => (theme() === "dark" ? inWords("Light theme") : inWords("Dark theme"));
  button.type = "button";
  button.className = "theme";
  button.textContent = label();
  button.addEventListener("click", () => choose(theme() === "dark" ? "light" : "dark"));
  for (const source of [document, matchMedia("(prefers-color-scheme: dark)")]) {
    source.addEventListener(source === document ? "themechange" : "change", () => {
      button.textContent = label();
    });
  }
  document.querySelector("header nav").append(button);
}

const chosen = localStorage.getItem(KEY);
if (chosen === "dark" || chosen === "light") document.documentElement.dataset.theme = chosen;
document.addEventListener("DOMContentLoaded", addSwitch);
