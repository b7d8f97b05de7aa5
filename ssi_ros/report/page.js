'use strict';
// Unpack Plotly and the pictures, then draw each picture when it comes near the view, so that the
// page opens at once; with #all in the address, or before printing, draw all of them.

async function unpack(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(stream).text();
}

function draw(place, pictures) {
  if (place.dataset.drawn) return Promise.resolve();
  place.dataset.drawn = 'begun';
  const picture = pictures[place.id], scene = picture.layout.scene, width = place.clientWidth;
  // step back from a scene until its width is in a narrow view
  if (scene) for (const k in scene.camera.eye) scene.camera.eye[k] *= Math.max(1, 760 / width);
  // a screen without a pointer shows the buttons always: not over a title
  return Plotly.newPlot(place, picture.data, picture.layout,
    { displaylogo: false, responsive: true, displayModeBar: width < 600 ? false : 'hover' }).then(() => {
      place.dataset.drawn = 'done';
      if (picture.motion && picture.motion.pick !== undefined) pick(place, picture.motion.pick);
      else if (picture.motion) move(place, picture.motion);
    });
}

// Pick poles by clicks: they are ringed, listed below the diagram, and saved as a file.
function pick(place, trace) {
  const picks = new Map(), box = document.createElement('div'), list = document.createElement('span');
  const save = document.createElement('button');
  box.className = 'controls';
  save.type = 'button';
  save.textContent = 'save picks.json';
  box.append(list, save);
  place.parentNode.after(box);
  Plotly.addTraces(place, { x: [], y: [], mode: 'markers', name: 'picked', hoverinfo: 'skip',
    marker: { symbol: 'circle-open', size: 15, color: '#b8600b', line: { width: 3 } } }, trace);
  function show() {
    const chosen = [...picks.values()].sort((a, b) => a.frequency_hz - b.frequency_hz);
    list.textContent = chosen.length ? 'Picked: ' + chosen.map(p =>
      p.frequency_hz.toFixed(4) + ' Hz (order ' + p.order + ')').join(', ') : 'No pole is picked.';
    save.disabled = !chosen.length;
    return Plotly.restyle(place, { x: [chosen.map(p => p.frequency_hz)],
      y: [chosen.map(p => p.order)] }, [trace]);
  }
  place.on('plotly_click', event => {
    const data = event.points[0].customdata;
    if (!data) return;
    const key = data.join();
    if (!picks.delete(key)) {
      picks.set(key, { frequency_hz: data[0], damping_ratio: data[1], order: data[2] });
    }
    show();
  });
  save.onclick = () => {
    const link = document.createElement('a'), text = JSON.stringify(
      { schema: 'ssi_ros/picks/1', picks: [...picks.values()] }, null, 1);
    link.href = URL.createObjectURL(new Blob([text + '\n'], { type: 'application/json' }));
    link.download = 'picks.json';
    link.click();
    URL.revokeObjectURL(link.href);
  };
  show();
}

// Swing the surfaces and sensors of a mode: height = real(shape * exp(j phase)).
function move(place, motion) {
  const controls = document.createElement('div');
  controls.className = 'controls';
  controls.innerHTML = '<label>mode <select></select></label><button type="button"></button>' +
    '<label>deflection <input type="range" min="0.2" max="3" step="0.1" value="1"></label>';
  place.before(controls);
  const [select, button, range] = ['select', 'button', 'input'].map(n => controls.querySelector(n));
  motion.modes.forEach((m, i) => select.add(new Option(m.label, i)));
  let playing = !matchMedia('(prefers-reduced-motion: reduce)').matches;
  let visible = true, phase = 0, last = 0, busy = false;

  function show() {
    const mode = motion.modes[select.value], scale = motion.scale_m * range.value;
    const height = (re, im) => re * Math.cos(phase) - im * Math.sin(phase);
    const z = mode.surfaces.map(s => s.re.map((row, i) => row.map((re, k) =>
      scale * height(re, s.im[i][k]))));
    const colour = mode.surfaces.map(s => s.re.map((row, i) => row.map((re, k) =>
      height(re, s.im[i][k]))));
    busy = true;
    const done = [Plotly.restyle(place, { z: z, surfacecolor: colour }, motion.surface_traces)];
    if (motion.sensor_trace !== null) {
      const dots = mode.sensors
        ? mode.sensors.re.map((re, k) => scale * height(re, mode.sensors.im[k])) : [];
      done.push(Plotly.restyle(place, { z: [dots] }, [motion.sensor_trace]));
    }
    Promise.all(done).then(() => { busy = false; });
  }
  function step(now) {
    if (playing && visible && !busy && now - last > 60) {
      phase += 2 * Math.PI * Math.min(now - last, 200) / 2000;
      last = now;
      show();
    }
    requestAnimationFrame(step);
  }
  function name() { button.textContent = playing ? 'pause' : 'play'; }
  button.onclick = () => { playing = !playing; name(); };
  select.onchange = range.oninput = show;
  new IntersectionObserver(seen => { visible = seen[0].isIntersecting; }).observe(place);
  name();
  show();
  requestAnimationFrame(step);
}

(async () => {
  const [code, text] = await Promise.all([unpack('plotly'), unpack('pictures')]);
  const script = document.createElement('script');
  script.textContent = code;
  document.head.append(script);
  const pictures = JSON.parse(text), places = [...document.querySelectorAll('.picture')];
  const all = () => Promise.all(places.map(p => draw(p, pictures)));
  addEventListener('beforeprint', all);
  if (location.hash === '#all') {
    await all();
  } else {
    const watch = new IntersectionObserver(seen => seen.forEach(s => {
      if (s.isIntersecting) draw(s.target, pictures);
    }), { rootMargin: '300px' });
    places.forEach(p => watch.observe(p));
  }
  document.documentElement.dataset.openedMs = Math.round(performance.now());
})().catch(error => {
  document.getElementById('trouble').textContent = 'The pictures could not be drawn: ' + error +
    '. The page needs a browser of 2023 or later.';
});
