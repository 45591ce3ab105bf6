"use strict";
(() => {
  // The tree of each task in the colours of one moment; the slider goes through the run.
  for (const course of document.querySelectorAll(".course")) {
    const bar = course.querySelector(".moment");
    const [play, slider, told] = ["button", "input", "output"].map((n) => bar.querySelector(n));
    const steps = [...course.querySelectorAll("[data-changes]")].map((place) => ({
      place,
      changes: JSON.parse(place.dataset.changes),
    }));
    if (!steps.length) continue;
    const paint = () => {
      const now = Number(slider.value);
      told.textContent = `${now.toFixed(1)} s`;
      for (const { place, changes } of steps) {
        const past = changes.filter(([since]) => since <= now + 1e-6);
        const status = past.length ? past[past.length - 1][1] : "pending";
        place.className = `step ${status}`;
        place.querySelector("i").textContent = status;
      }
    };
    let clock = 0;
    const stop = () => {
      clearInterval(clock);
      clock = 0;
      play.textContent = "▶";
    };
    play.addEventListener("click", () => {
      if (clock) return stop();
      if (Number(slider.value) >= Number(slider.max)) slider.value = 0;
      play.textContent = "⏸";
      clock = setInterval(() => {
        slider.value = Number(slider.value) + Number(slider.max) / 150;
        paint();
        if (Number(slider.value) >= Number(slider.max)) stop();
      }, 80);
    });
    slider.addEventListener("input", paint);
    bar.hidden = false;
  }

  // Enlarged key frames, with the arrow keys to go through them.
  const viewer = document.getElementById("viewer");
  const shown = viewer.querySelector("figure");
  const all = [...document.querySelectorAll(".gallery > figure")];
  let at = 0;
  const show = (index) => {
    at = (index + all.length) % all.length;
    const copy = all[at].querySelector("img").cloneNode();
    shown.replaceChildren(copy, all[at].querySelector("figcaption").cloneNode(true));
  };
  all.forEach((figure, index) => {
    figure.querySelector(".open").addEventListener("click", () => {
      show(index);
      viewer.showModal();
    });
  });
  viewer.addEventListener("click", (event) => {
    const key = event.target.closest("button");
    if (event.target === viewer || (key && "close" in key.dataset)) viewer.close();
    else if (key) show(at + Number(key.dataset.go));
  });
  viewer.addEventListener("keydown", (event) => {
    if (event.key === "ArrowLeft") show(at - 1);
    if (event.key === "ArrowRight") show(at + 1);
  });
})();
