"use strict";
(() => {
  // One cursor for video, figures, tasks and text: whatever is moved, the others follow.
  const box = document.getElementById("cursor");
  if (!box) return;
  const duration = Number(box.dataset.duration);
  const video = box.querySelector("video");
  const [play, slider, told] = ["button", "input", "output"].map((n) => box.querySelector(n));
  const lines = [...document.querySelectorAll(".narrative .told")];
  const courses = [...document.querySelectorAll(".course .moment input")];
  let now = 0;
  let clock = 0;

  const usable = () => video && !video.error && video.duration > 0 && Number.isFinite(video.duration);
  const axisOf = (area) => area._fullLayout && area._fullLayout.xaxis;

  const mark = (area) => {
    const axis = axisOf(area);
    if (!axis) return;
    let line = area.querySelector(":scope > .cursor-line");
    if (!line) {
      line = document.createElement("i");
      line.className = "cursor-line";
      area.append(line);
    }
    const size = area._fullLayout._size;
    line.style.left = `${axis._offset + axis.l2p(now)}px`;
    line.style.top = `${size.t}px`;
    line.style.height = `${size.h}px`;
  };
  const areas = [...document.querySelectorAll(".plot-area")];

  const show = () => {
    slider.value = now;
    told.textContent = `${now.toFixed(1)} s`;
    areas.forEach(mark);
    let last = null;
    for (const line of lines) {
      if (Number(line.dataset.time) <= now + 1e-6) last = line;
      line.removeAttribute("aria-current");
    }
    if (last) last.setAttribute("aria-current", "true");
    for (const course of courses) {
      course.value = now;
      course.dispatchEvent(new Event("input"));
    }
  };
  const seek = () => {
    if (usable()) video.currentTime = (now / duration) * video.duration;
  };
  const go = (time) => {
    unfold();
    now = Math.min(Math.max(time, 0), duration);
    seek();
    show();
  };
  // A move that came before the length of the video was known is made good.
  if (video) video.addEventListener("durationchange", seek);

  // The video is folded until a moment is asked for, since it covers a corner of the page; on a small
  // screen, where it would cover what one reads, until it is asked for itself.
  const fold = box.querySelector("[data-fold]");
  let waits = !matchMedia("(max-width: 34rem)").matches;
  const folded = (yes) => {
    box.classList.toggle("folded", yes);
    fold.textContent = yes ? "+" : "–";
    fold.setAttribute("aria-expanded", String(!yes));
  };
  const unfold = () => {
    if (fold && waits) folded(false);
    waits = false;
  };
  if (fold) {
    folded(true);
    fold.addEventListener("click", () => {
      waits = false;
      folded(!box.classList.contains("folded"));
    });
  }

  const rest = () => {
    clearInterval(clock);
    clock = 0;
    play.textContent = "▶";
  };
  const follow = () => {
    if (usable()) now = (video.currentTime / video.duration) * duration;
    else now = Math.min(now + 0.08, duration);
    show();
    if (usable() ? video.ended : now >= duration) rest();
  };
  play.addEventListener("click", () => {
    unfold();
    if (clock) {
      if (video) video.pause();
      return rest();
    }
    if (now >= duration - 0.05) go(0);
    if (usable()) video.play();
    play.textContent = "⏸";
    clock = setInterval(follow, 80);
  });
  slider.addEventListener("input", () => go(Number(slider.value)));
  for (const area of areas) {
    // Plotly keeps clicks to itself; a press that does not move is one.
    area.addEventListener(
      "mousedown",
      (down) => {
        const up = (event) => {
          const axis = axisOf(area);
          const place = event.clientX - area.getBoundingClientRect().left - axis._offset;
          if (Math.abs(event.clientX - down.clientX) < 4) go(axis.p2l(place));
        };
        if (axisOf(area)) addEventListener("mouseup", up, { capture: true, once: true });
      },
      true,
    );
  }
  addEventListener("resize", () => setTimeout(show, 250));
  if (video) {
    const gone = () => {
      video.remove();
      if (fold) fold.remove();
    };
    video.addEventListener("error", gone, { once: true });
    video.addEventListener("click", () => play.click());
  }
  box.hidden = false;
  show();
})();
