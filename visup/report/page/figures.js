"use strict";
(() => {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const printing = matchMedia("print");
  const figures = JSON.parse(document.getElementById("figures").textContent);

  // Colours of text and ground come from the page, so that figures follow light, dark and paper.
  const themed = (layout) => {
    const page = getComputedStyle(document.documentElement);
    const colour = (name) => page.getPropertyValue(name).trim();
    const axis = { gridcolor: colour("--edge"), linecolor: colour("--edge"), automargin: true };
    return {
      ...layout,
      autosize: true,
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: colour("--ink"), family: "system-ui, sans-serif", size: 13 },
      legend: { ...layout.legend, font: { color: colour("--ink") } },
      xaxis: { ...layout.xaxis, ...axis },
      yaxis: { ...layout.yaxis, ...axis },
    };
  };

  const draw = () => {
    for (const figure of figures) {
      const place = document.getElementById(figure.id);
      Plotly.react(place, figure.data, themed(figure.layout), {
        responsive: true,
        displaylogo: false,
        displayModeBar: false,
      });
    }
  };
  if (figures.length) {
    draw();
    dark.addEventListener("change", draw);
    printing.addEventListener("change", draw);
  }
})();
