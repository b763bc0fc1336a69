"use strict";
// Keeps what a person typed or ticked when a form's answer is another page: the page's other forms, and the form itself
// where nothing was done. It is kept in this tab only, until the next page that is none of these, and no secret is.

const KEPT = "menshin-forms";
const SECRETS = ["key", "secret"];
const UNKEPT = ["hidden", "password", "file", "submit", "button", "reset", "fieldset"];

function fieldsOf(form) {
  return [...form.elements].filter((one) => one.name && !UNKEPT.includes(one.type) && !SECRETS.includes(one.name));
}

function formsHere() {
  return [...document.forms].filter((form) => form.method === "post" && fieldsOf(form).length > 0);
}

function keep(sent) {
  const kept = formsHere().map((form) => ({
    action: form.getAttribute("action"),
    wasSent: form === sent,
    fields: fieldsOf(form).map((one) => ({ name: one.name, value: one.value, checked: one.checked })),
  }));
  sessionStorage.setItem(KEPT, JSON.stringify(kept));
}

function fill(form, fields) {
  for (const field of fieldsOf(form)) {
    const isChoice = field.type === "checkbox" || field.type === "radio";
    const had = fields.find((one) => one.name === field.name && (!isChoice || one.value === field.value));
    if (had === undefined || (field.value === had.value && field.checked === had.checked)) continue;
    if (isChoice) field.checked = had.checked;
    else field.value = had.value;
    field.closest("details")?.setAttribute("open", "");
  }
}

function restore() {
  const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "[]");
  const undone = document.querySelector("[data-undone]");
  if (undone !== null) {
    undone.hidden = kept.length === 0;
    sessionStorage.setItem(KEPT, JSON.stringify(kept.map((one) => ({ ...one, wasSent: false }))));
    return;
  }
  if (document.querySelector("form.login") !== null) return; // on the way back
  sessionStorage.removeItem(KEPT);
  for (const form of formsHere()) {
    const had = kept.find((one) => !one.wasSent && one.action === form.getAttribute("action"));
    if (had !== undefined) fill(form, had.fields);
  }
}

document.addEventListener("submit", (event) => {
  const action = event.target.getAttribute("action");
  if (action === "/logout") sessionStorage.removeItem(KEPT);
  else if (action !== "/login") keep(event.target);
});
restore();
