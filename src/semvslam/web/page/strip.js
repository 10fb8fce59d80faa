const kStripLeft = 66, kStripRight = 8, kStripTop = 16, kStripBottom = 18;

// A chart of one value over time; a click or a drag goes to its time.
class Strip {
  constructor(canvas, onSeek) {
    this.canvas = canvas;
    const seek = (e) => {
      const box = canvas.getBoundingClientRect();
      onSeek(clamp((e.clientX - box.left - kStripLeft) / (box.width - kStripLeft - kStripRight), 0, 1));
    };
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      seek(e);
    });
    canvas.addEventListener("pointermove", (e) => {
      if (e.buttons & 1) seek(e);
    });
  }

  // curves: [{colour, times, values, hasGapAfter}]
  draw({title, curves, duration, time, textColour, lineColour, format}) {
    const ratio = window.devicePixelRatio || 1, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    [this.canvas.width, this.canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    const pen = this.canvas.getContext("2d");
    pen.scale(ratio, ratio);
    const inner = {width: width - kStripLeft - kStripRight, height: height - kStripTop - kStripBottom};
    let most = 0;
    for (const curve of curves)
      for (const value of curve.values) if (value > most) most = value;
    const x = (t) => kStripLeft + (duration > 0 ? t / duration : 0) * inner.width;
    const y = (value) => kStripTop + (1 - (most > 0 ? value / most : 0)) * inner.height;
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = textColour;
    pen.strokeStyle = lineColour;
    pen.strokeRect(kStripLeft + 0.5, kStripTop + 0.5, inner.width - 1, inner.height - 1);
    pen.fillText(title, kStripLeft, 11);
    pen.textAlign = "right";
    pen.fillText(format(most), kStripLeft - 5, kStripTop + 9);
    pen.fillText("0", kStripLeft - 5, kStripTop + inner.height);
    pen.fillText(duration.toFixed(1) + " s", kStripLeft + inner.width, height - 4);
    pen.textAlign = "left";
    pen.fillText("0", kStripLeft, height - 4);
    for (const curve of curves) {
      pen.strokeStyle = curve.colour;
      pen.beginPath();
      let isDrawing = false;
      curve.values.forEach((value, i) => {
        if (!Number.isFinite(value)) return void (isDrawing = false);
        if (isDrawing) pen.lineTo(x(curve.times[i]), y(value));
        else pen.moveTo(x(curve.times[i]), y(value));
        isDrawing = !curve.hasGapAfter(i);
      });
      pen.stroke();
    }
    pen.strokeStyle = textColour;
    pen.beginPath();
    pen.moveTo(x(time), kStripTop);
    pen.lineTo(x(time), kStripTop + inner.height);
    pen.stroke();
  }
}
