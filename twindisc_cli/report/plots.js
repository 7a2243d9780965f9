// Draws the plots of the page with uPlot: drag to zoom, double-click to see all again.
(function () {
  const plots = JSON.parse(document.getElementById("plots").textContent);
  const colours = ["#7f7f7f", "#e69f00", "#0072b2"];
  const plain = (text) => text.replace(/\$\\?([a-z]+)[^$]*\$/gi, "").replace(/\s+/g, " ").trim();
  const draw = (plot, box) => {
    const shown = plot.data.map((v, i) => [v, i]).filter(([v]) => v !== null);
    const series = shown.map(([, i]) => i === 0 ? { label: plain(plot.x) } : {
      label: plot.names[i - 1], stroke: colours[i - 1], width: i === 2 ? 2 : 1.5,
      dash: i === 2 ? [6, 4] : undefined,
      paths: i === 1 || !plot.lines ? () => null : undefined,
      points: { show: i === 1 || !plot.lines, size: shown[0][0].length > 300 ? 3 : 5, fill: colours[i - 1] },
    });
    const options = {
      title: plot.title, width: box.clientWidth, height: 300, series,
      scales: { x: { time: false, distr: plot.log ? 3 : 1 } },
      axes: [{ label: plain(plot.x) }, { label: plain(plot.y), size: 64 }],
      cursor: { drag: { x: true, y: true, uni: 20 } },
    };
    const drawn = new uPlot(options, shown.map(([v]) => v), box);
    window.addEventListener("resize", () => drawn.setSize({ width: box.clientWidth, height: 300 }));
  };
  plots.forEach((plot, i) => draw(plot, document.getElementById("plot" + i)));
})();
