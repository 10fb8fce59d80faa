const kFloatsPerLinePoint = 7;  // x y z, colour, 1 = a segment begins here (0 = none does)

class Renderer {
  // Throws where WebGL 2 is absent.
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", {antialias: true, alpha: true, premultipliedAlpha: false});
    if (!this.gl) throw new Error("no WebGL 2");
    this.lineProgram = this.program(kLineVertexShader);
    this.pointProgram = this.program(kPointVertexShader);
    this.lines = new Map();
    this.clouds = [];
  }

  program(vertexSource) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertexSource], [gl.FRAGMENT_SHADER, kFragmentShader]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error("WebGL: " + gl.getProgramInfoLog(program));
    return program;
  }

  buffer(data) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return buffer;
  }

  attribute(program, name, size, type, normalise, stride, offset, divisor) {
    const gl = this.gl, at = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, type, normalise, stride, offset);
    gl.vertexAttribDivisor(at, divisor);
  }

  // Replaces the lines of that name. `points` as kFloatsPerLinePoint says.
  setLines(name, points, widthPixels, opacity = 1) {
    const gl = this.gl, old = this.lines.get(name);
    if (old) {
      gl.deleteBuffer(old.buffer);
      gl.deleteVertexArray(old.vertices);
      this.lines.delete(name);
    }
    const segments = points.length / kFloatsPerLinePoint - 1;
    if (segments < 1) return;
    const vertices = gl.createVertexArray(), stride = 4 * kFloatsPerLinePoint;
    gl.bindVertexArray(vertices);
    const buffer = this.buffer(new Float32Array(points));
    for (const [prefix, start] of [["from", 0], ["to", stride]]) {
      this.attribute(this.lineProgram, prefix, 3, gl.FLOAT, false, stride, start, 1);
      this.attribute(this.lineProgram, prefix + "Colour", 4, gl.FLOAT, false, stride, start + 12, 1);
    }
    this.lines.set(name, {vertices, buffer, segments, widthPixels, opacity});
  }

  setClouds(clouds) {
    const gl = this.gl;
    for (const old of this.clouds) {
      old.buffers.forEach((b) => gl.deleteBuffer(b));
      gl.deleteVertexArray(old.vertices);
    }
    this.clouds = clouds.map((cloud) => {
      const vertices = gl.createVertexArray(), hasColours = cloud.colours.length > 0;
      gl.bindVertexArray(vertices);
      const buffers = [this.buffer(cloud.grid)];
      this.attribute(this.pointProgram, "grid", 3, gl.UNSIGNED_SHORT, false, 6, 0, 0);
      if (hasColours) {
        buffers.push(this.buffer(cloud.colours));
        this.attribute(this.pointProgram, "rgb", 3, gl.UNSIGNED_BYTE, true, 3, 0, 0);
      }
      return {...cloud, vertices, buffers, hasColours, count: cloud.grid.length / 3};
    });
  }

  // The canvas follows its size on the page. Returns width / height.
  fit() {
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) [this.canvas.width, this.canvas.height] = [width, height];
    this.pixelRatio = ratio;
    return width / height;
  }

  // look: {clipFromWorld, focal (of the picture's height), up, heights, low, high, pointScale, isShown(name or cloud index)}
  draw(look) {
    const gl = this.gl;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.drawClouds(look);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    // What lies behind points is still to be seen, faintly.
    gl.disable(gl.DEPTH_TEST);
    this.drawLines(look, 0.35);
    gl.enable(gl.DEPTH_TEST);
    this.drawLines(look, 1);
    gl.disable(gl.BLEND);
  }

  drawClouds(look) {
    const gl = this.gl, program = this.pointProgram, at = (name) => gl.getUniformLocation(program, name);
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("clipFromWorld"), false, look.clipFromWorld);
    gl.uniform3fv(at("up"), look.up);
    gl.uniform2fv(at("heights"), look.heights);
    gl.uniform3fv(at("low"), look.low);
    gl.uniform3fv(at("high"), look.high);
    this.clouds.forEach((cloud, i) => {
      if (!look.isShown(i)) return;
      // A point covers its part of the surface; the smallest can still be seen.
      const side = look.pointScale * (cloud.hasColours ? Math.max(0.012, 1.3 * cloud.cell) : 0);
      gl.uniform1f(at("worldPixels"), side * look.focal * this.canvas.height);
      gl.uniform1f(at("pixels"), look.pointScale * (cloud.hasColours ? 1.5 : 2.5) * this.pixelRatio);
      gl.uniform3fv(at("origin"), cloud.origin);
      gl.uniform3fv(at("gridStep"), cloud.step);
      gl.uniform1i(at("hasColours"), cloud.hasColours ? 1 : 0);
      gl.bindVertexArray(cloud.vertices);
      gl.drawArrays(gl.POINTS, 0, cloud.count);
    });
  }

  drawLines(look, opacity) {
    const gl = this.gl, program = this.lineProgram, at = (name) => gl.getUniformLocation(program, name);
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("clipFromWorld"), false, look.clipFromWorld);
    gl.uniform2f(at("viewport"), this.canvas.width, this.canvas.height);
    for (const [name, lines] of this.lines) {
      if (!look.isShown(name)) continue;
      gl.uniform1f(at("opacity"), opacity * lines.opacity);
      gl.uniform1f(at("width"), lines.widthPixels * this.pixelRatio);
      gl.bindVertexArray(lines.vertices);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.segments);
    }
  }
}
