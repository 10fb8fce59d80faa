// A line is drawn segment by segment as a rectangle in the picture: lines of WebGL are a pixel wide.
const kLineVertexShader = `#version 300 es
in vec3 from; in vec4 fromColour; in vec3 to; in vec4 toColour;
uniform mat4 clipFromWorld; uniform vec2 viewport; uniform float width; uniform float opacity;
out vec4 colour;
void main() {
  bool atStart = gl_VertexID < 2;
  colour = vec4(atStart ? fromColour.rgb : toColour.rgb, opacity);
  vec4 a = clipFromWorld * vec4(from, 1.0), b = clipFromWorld * vec4(to, 1.0);
  const float near = 1e-3;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // not in the picture
  if (fromColour.a == 0.0 || (a.w < near && b.w < near)) return;
  if (a.w < near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * viewport;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x) * ((gl_VertexID & 1) == 0 ? -1.0 : 1.0);
  vec4 end = atStart ? a : b;
  end.xy += (across + along * (atStart ? -0.5 : 0.5)) * width / viewport * end.w;
  gl_Position = end;
}`;

const kPointVertexShader = `#version 300 es
in vec3 grid; in vec3 rgb;
uniform mat4 clipFromWorld; uniform vec3 origin; uniform vec3 gridStep; uniform float pixels; uniform float worldPixels;
uniform bool hasColours; uniform vec3 up; uniform vec2 heights; uniform vec3 low; uniform vec3 high;
out vec4 colour;
void main() {
  vec3 position = origin + gridStep * grid;
  gl_Position = clipFromWorld * vec4(position, 1.0);
  gl_PointSize = clamp(worldPixels / gl_Position.w, pixels, 40.0);
  float height = clamp((dot(up, position) - heights.x) / (heights.y - heights.x), 0.0, 1.0);
  colour = vec4(hasColours ? rgb : mix(low, high, height), 1.0);
}`;

const kFragmentShader = `#version 300 es
precision mediump float;
in vec4 colour;
out vec4 pixel;
void main() { pixel = colour; }`;
