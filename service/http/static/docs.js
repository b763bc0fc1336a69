"use strict";
// Swagger UI in place of the reference as text. Requests are sent with the browser's own session.

function dark() {
  const chosen = document.documentElement.dataset.theme;
  const isDark = chosen === undefined ? matchMedia("(prefers-color-scheme: dark)").matches : chosen === "dark";
  document.documentElement.classList.toggle("dark-mode", isDark);
}

// Paths without links: they would stand inside buttons. The page has a heading of its own.
const AMENDED = {
  wrapComponents: {
    DeepLink: (_, { React }) => ({ text }) => React.createElement("span", null, text),
    info: () => () => null,
  },
};
const shell = document.getElementById("swagger");
SwaggerUIBundle({
  url: shell.dataset.document,
  domNode: shell,
  deepLinking: true,
  docExpansion: "list",
  filter: true,
  defaultModelsExpandDepth: 0,
  validatorUrl: null,
  plugins: [() => AMENDED],
  onComplete: () => {
    shell.hidden = false;
    document.getElementById("reference").hidden = true;
  },
});
document.addEventListener("themechange", dark);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", dark);
dark();
