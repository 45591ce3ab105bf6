"use strict";
(() => {
  // The list of alerts, cut down to what one looks for.
  const bar = document.querySelector(".alert-filter");
  if (!bar) return;
  const [severity, kind] = bar.querySelectorAll("select");
  const open = bar.querySelector("input[type=checkbox]");
  const text = bar.querySelector("input[type=search]");
  const told = bar.querySelector("output");
  const all = [...document.querySelectorAll(".alert")];
  const cut = () => {
    const words = text.value.trim().toLowerCase();
    let shown = 0;
    for (const alert of all) {
      const fits =
        (!severity.value || alert.dataset.severity === severity.value) &&
        (!kind.value || alert.dataset.kind === kind.value) &&
        (!open.checked || "open" in alert.dataset) &&
        (!words || alert.textContent.toLowerCase().includes(words));
      alert.hidden = !fits;
      shown += fits;
    }
    told.textContent = `${shown} of ${all.length}`;
  };
  bar.addEventListener("input", cut);
  bar.hidden = false;
  cut();
})();
