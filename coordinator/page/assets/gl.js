// Short functions for common operations of WebGL 2.

function shader(gl, kind, source) {
  const made = gl.createShader(kind);
  gl.shaderSource(made, source);
  gl.compileShader(made);
  if (!gl.getShaderParameter(made, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(made));
  return made;
}

/** A program of `[vertex, fragment]`; `at(name)` is the place of a uniform. */
export function program(gl, [vertex, fragment]) {
  const id = gl.createProgram();
  gl.attachShader(id, shader(gl, gl.VERTEX_SHADER, vertex));
  gl.attachShader(id, shader(gl, gl.FRAGMENT_SHADER, fragment));
  gl.linkProgram(id);
  if (!gl.getProgramParameter(id, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(id));
  const places = new Map();
  const at = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(id, name));
    return places.get(name);
  };
  return { id, at };
}

/** An empty texture. */
export function texture(gl, format, width, height, filter) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, filter);
  for (const which of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, which, gl.CLAMP_TO_EDGE);
  return made;
}

/** Numbers of the bound buffer as an attribute; `divisor` 1: one for each instance. */
export function attribute(gl, index, count, stride, offset, divisor) {
  gl.enableVertexAttribArray(index);
  gl.vertexAttribPointer(index, count, gl.FLOAT, false, stride, offset);
  gl.vertexAttribDivisor(index, divisor);
}
