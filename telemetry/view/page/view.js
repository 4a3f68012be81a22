// SPDX-License-Identifier: BSD-3-Clause
import {Chart} from './chart.js';
import {Orbit} from './orbit.js';
import {Scene} from './scene.js';
import {Feed} from './wire.js';

const $ = (id) => document.getElementById(id);
const token = document.querySelector('meta[name=token]').content;
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
const SILENCE = 6000;  // milliseconds without an event after which the link counts as lost

let run = null, newest = null, heard = performance.now(), stream = null, logNumber = 0, loopCount = 0, image = 0;
let link = 'connecting';
const isNarrow = () => matchMedia('(max-width: 760px), (max-height: 480px)').matches;
if (location.search) history.replaceState(null, '', '/');  // the cookie has the token now

// ---- what is drawn
const orbit = new Orbit($('scene'), () => press('views', 'view', 'free'));
let scene = null;
try {
  scene = new Scene($('scene'), orbit);
} catch (error) {
  say(`no map: ${error.message}`, true);
}
const chart = new Chart($('chart'));
const feeds = scene && [
  new Feed('/path', (...part) => scene.takePath(...part)),
  new Feed('/keyframes', (...part) => scene.takeKeyframes(...part)),
  new Feed('/points', (...part) => scene.takePoints(...part)),
  new Feed('/dense', (...part) => scene.takeBlocks(...part)),
];

function animate() {
  if (scene) scene.draw();
  chart.draw();
  requestAnimationFrame(animate);
}

// ---- words; texts of the run are only ever set as text
function say(text, isAlarm) {
  $('message').textContent = text;
  $('message').classList.toggle('alarm', !!isAlarm);
  document.body.classList.toggle('troubled', !!isAlarm);
}

function press(group, kind, value) {
  for (const button of $(group).children)
    button.setAttribute('aria-pressed', String(button.dataset[kind] === value));
}

const time = (s) => `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, '0')}`;
let begin = 0;  // seconds, timestamp of the first frame

function showNumbers(event) {
  const percent = (part, all) => all ? ` (${Math.round(100 * part / all)} %)` : '';
  const lines = [
    ['frame', event.frames ? `${event.frame + 1} / ${event.frames}` : event.processed],
    ['rate', `${event.fps.toFixed(event.fps < 10 ? 1 : 0)} fps`],
    ['tracked', percent(event.tracked, event.processed).slice(2, -1) || '–'],
    ['inliers', event.inliers],
    ['keyframes', event.keyframes],
    ['landmarks', scene ? scene.count().landmarks : '–'],
    ['loops', event.loops],
    ['submap', event.submap === null ? '–' : event.submap],
  ];
  $('numbers').replaceChildren(...lines.map(([name, value]) => {
    const line = document.createElement('div');
    for (const [tag, text] of [['dt', name], ['dd', value]])
      line.appendChild(document.createElement(tag)).textContent = text;
    return line;
  }));
}

function showState() {
  const event = newest, badge = $('state');
  if (link !== 'up' || !event) {
    badge.dataset.level = 'none';
    badge.textContent = link === 'refused' ? 'refused' : event && event.phase === 'ended' ? 'run ended' : 'no link';
    if (!event && link === 'connecting') badge.textContent = 'connecting';
    return;
  }
  badge.dataset.level = event.health === 'ended' ? 'none' : event.health;
  const over = {saving: 'saving', ended: 'run ended', recorded: 'recorded run', paused: 'paused', starting: 'starting'};
  badge.textContent = over[event.phase] || event.state;
  for (const name of ['save', 'pause', 'stop']) $(name).hidden = !event.can.includes(name);
  $('pause').textContent = event.phase === 'paused' ? 'Resume' : 'Pause';
  $('picture').hidden = !event.can.includes('image');
  $('reasons').replaceChildren(...(event.health === 'ended' ? [] : event.reasons).map((reason) => {
    const line = document.createElement('li');
    line.textContent = reason;
    return line;
  }));
}

function take(event) {
  if (run !== null && event.run !== run) return location.reload();  // another run: all anew
  run = event.run;
  newest = event;
  heard = performance.now();
  link = 'up';
  begin = event.begun;
  $('source').textContent = event.source;
  document.title = `${event.health === 'lost' ? 'lost' : event.phase} – RO-SLAM`;
  say(event.phase === 'recorded' ? '' : time(event.t - begin));
  if (scene) scene.takePose(event.pose, event.health === 'lost');
  if (event.phase === 'flying') chart.add(event);
  showNumbers(event);
  showState();
}

// ---- the link
function connect() {
  if (stream) stream.close();
  stream = new EventSource('/events');
  stream.onmessage = (message) => take(JSON.parse(message.data));
  stream.onerror = async () => {
    if (link === 'up') link = 'down';
    if (stream.readyState !== EventSource.CLOSED) return;  // it tries again by itself
    await wait(2000);
    connect();
  };
}

// Why there is no link, where the server says so.
async function watchLink() {
  for (;;) {
    await wait(1000);
    if (link === 'up' && performance.now() - heard < SILENCE) continue;
    if (link === 'up') {
      link = 'down';
      connect();
    }
    const silence = Math.round((performance.now() - heard) / 1000);
    const over = newest && ['ended', 'saving'].includes(newest.phase);
    let text = over ? 'waiting for another run' : `no link for ${silence} s, trying again`;
    try {
      const reply = await fetch('/health', {signal: AbortSignal.timeout(2000)});
      if (reply.status === 401) [link, text] = ['refused', 'open the address with the token that the run printed'];
      else text = 'too many viewers, trying again';
    } catch (error) { /* nobody there: text says so */ }
    if (link === 'up') continue;
    say(text, true);
    showState();
  }
}

// ---- what is fetched while the page is seen
async function followMap() {
  for (;;) {
    const begun = performance.now();
    if (!document.hidden && link === 'up' && feeds) {
      try {
        for (const feed of feeds) await feed.update();
        if (newest.loops !== loopCount) {
          scene.takeLoops(await (await fetch('/loops')).json());
          loopCount = newest.loops;
        }
      } catch (error) { /* the link is watched elsewhere */ }
    }
    await wait(Math.max(1000 - (performance.now() - begun), 200));
  }
}

async function followLog() {
  for (;;) {
    if (link === 'up' && newest.log !== logNumber) {
      try {
        for (const entry of await (await fetch(`/log?since=${logNumber}`)).json()) {
          const line = document.createElement('li');
          line.classList.toggle('warning', entry.warning);
          line.appendChild(document.createElement('time')).textContent = time(Math.max(entry.t - begin, 0));
          line.appendChild(document.createElement('span')).textContent = entry.text;
          $('log').prepend(line);
          logNumber = entry.n;
        }
        while ($('log').children.length > 100) $('log').lastChild.remove();
      } catch (error) { /* as above */ }
    }
    await wait(500);
  }
}

async function followImage() {
  for (;;) {
    const begun = performance.now();
    if (link === 'up' && !document.hidden && $('picture').clientWidth > 0) {
      try {
        const reply = await fetch(`/frame.jpg?after=${image}`);
        if (reply.status === 200) {
          image = reply.headers.get('X-Number');
          const old = $('image').src;
          $('image').src = URL.createObjectURL(await reply.blob());
          if (old) URL.revokeObjectURL(old);
        }
      } catch (error) { /* as above */ }
    }
    await wait(Math.max(200 - (performance.now() - begun), 100));
  }
}

// ---- what the user does
async function command(name) {
  try {
    const reply = await fetch(`/${name}`, {method: 'POST', headers: {'X-RO-SLAM-Token': token}});
    if (!reply.ok) say(await reply.text(), true);
  } catch (error) {
    say(`${name}: no link`, true);
  }
}
$('save').onclick = () => command('save');
$('pause').onclick = () => command(newest.phase === 'paused' ? 'resume' : 'pause');
$('stop').onclick = () => $('confirm').showModal();
$('confirm').onclose = () => {
  if ($('confirm').returnValue === 'yes') command('stop');
  $('confirm').returnValue = '';
};
for (const button of $('views').children) button.onclick = () => {
  orbit.setMode(button.dataset.view);
  press('views', 'view', button.dataset.view);
};
for (const button of $('layers').children) {
  button.setAttribute('aria-pressed', 'true');
  button.onclick = () => {
    scene.layers[button.dataset.layer] = !scene.layers[button.dataset.layer];
    button.setAttribute('aria-pressed', String(scene.layers[button.dataset.layer]));
  };
}
function openSheet(name) {
  document.body.dataset.sheet = name;
  press('sheets', 'sheet', name);
}
for (const button of $('sheets').children)
  button.onclick = () => openSheet(document.body.dataset.sheet === button.dataset.sheet ? '' : button.dataset.sheet);
if (isNarrow()) openSheet('picture');
press('views', 'view', 'follow');

globalThis.roslam = {scene, orbit, chart, get event() { return newest; }, get link() { return link; }};
connect();
watchLink();
followMap();
followLog();
followImage();
animate();
