// A canvas at its size on the screen, in pixels of the screen.

// Clears it and returns its context, scaled to CSS pixels, with its size; null while it is not shown.
export function clear(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight, ratio = devicePixelRatio || 1;
  if (width < 2 || height < 2) return null;
  const w = Math.round(width * ratio), h = Math.round(height * ratio);
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return {context, width, height};
}

// The page's own measure, which grows with the window (view.css), so that canvases grow with it.
const kSmallestPx = 17;
let rootPx = kSmallestPx;
export function measure() { rootPx = parseFloat(getComputedStyle(document.documentElement).fontSize) || kSmallestPx; }
// Of so many pixels in the smallest window.
export const scaled = (px) => px * rootPx / kSmallestPx;
export const font = (px = 15) => `${scaled(px)}px system-ui, "DejaVu Sans", sans-serif`;
