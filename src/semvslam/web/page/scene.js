// Runs as lines for the renderer.

const kKinds = {
  error: {title: "error", format: (value) => (1e3 * value).toFixed(1) + " mm"},
  speed: {title: "speed", format: (value) => value.toFixed(2) + " m/s"},
  time: {title: "time", format: (value) => value.toFixed(1) + " s"},
};

// The values that a colour stands for: from 0 to all but the largest hundredth.
function rangeOf(runs, kind) {
  const values = runs.flatMap((run) => run.values(kind)).filter(Number.isFinite).sort((a, b) => a - b);
  return values.length ? values[Math.floor(0.99 * (values.length - 1))] : 0;
}

function wayLine(track, colourAt) {
  const points = [];
  for (let i = 0; i < track.size; ++i) {
    const begins = i + 1 < track.size && !track.hasGapAfter(i);
    points.push(...track.positions[i], ...colourAt(i), begins ? 1 : 0);
  }
  return points;
}

function colouredWay(run, kind, most) {
  const plain = colourOf(run.colour);
  if (kind === "run") return wayLine(run.track, () => plain);
  const values = run.values(kind);
  return wayLine(run.track, (i) => (Number.isFinite(values[i]) ? rampColour(most > 0 ? values[i] / most : 0) : [0.5, 0.5, 0.5]));
}

// A camera as a pyramid that opens to where it looks. `depth` in metres.
function addFrustum(points, position, rotation, depth, colour) {
  const corner = (x, y) => add(position, rotated(rotation, [0.62 * x * depth, 0.465 * y * depth, depth]));
  const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
  const strokes = [[position, corners[0], corners[1], position, corners[2], corners[3], position], [...corners, corners[0]],
                   [corner(-0.4, -1), corner(0, -1.5), corner(0.4, -1)]];  // a roof: which way is up
  for (const stroke of strokes) stroke.forEach((p, i) => points.push(...p, ...colour, i + 1 < stroke.length ? 1 : 0));
}

function frusta(track, depth, colour) {
  const points = [];
  for (let i = 0; i < track.size; ++i) addFrustum(points, track.positions[i], track.rotations[i], depth, colour);
  return points;
}
