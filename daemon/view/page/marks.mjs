// A feature is marked alike in the picture and in three dimensions: by its shape, and then by colour.
const kConverged = 2, kInconsistent = 3;  // FeatureState of perimap.idl

// x, y: its middle. size: half of its width, in pixels of the canvas.
export function drawFeature(context, x, y, state, size) {
  context.beginPath();
  if (state === kInconsistent) {
    context.strokeStyle = "#ff9d6c";
    context.lineWidth = 0.7 * size;
    context.moveTo(x - 1.4 * size, y - 1.4 * size); context.lineTo(x + 1.4 * size, y + 1.4 * size);
    context.moveTo(x + 1.4 * size, y - 1.4 * size); context.lineTo(x - 1.4 * size, y + 1.4 * size);
    context.stroke();
    return;
  }
  context.arc(x, y, size, 0, 2 * Math.PI);
  context.lineWidth = 0.5 * size;
  if (state === kConverged) {
    context.fillStyle = "#fff";
    context.fill();
    context.strokeStyle = "#10161b";
  } else {
    context.strokeStyle = "#fff";
  }
  context.stroke();
}
