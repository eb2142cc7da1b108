// The connection to the server: one message is on its way at most; of those that replace one another the newest waits.

const RETRY = 500; // [ms]
const live = { socket: null, awaiting: false, queue: new Map(), state: null, taken: 0, lost: false };
const followers = [];
const SELDOM = ["around", "file", "program", "modules"];
// What takes a message that is no state, by the only key of that.
const answers = {};

// `key` names what a message replaces while it waits.
function send(message, key = `${message.do} ${live.taken++}`) {
  live.queue.delete(key);
  live.queue.set(key, message);
  flush();
}

// A message that does not wait: a jog must stop at once.
function sendNow(message) {
  if (live.socket?.readyState === WebSocket.OPEN) live.socket.send(JSON.stringify(message));
}

// In a notebook the page is in a frame without an address, and what is around it passes messages on.
function connectAround() {
  live.socket = { readyState: WebSocket.OPEN, send: (text) => parent.postMessage(text, "*"), close: () => {} };
  addEventListener("message", (event) => {
    if (event.source === parent && typeof event.data === "string") receive(event.data);
  });
  parent.postMessage("hello", "*");
}

function flush() {
  if (live.awaiting || !live.queue.size || live.socket?.readyState !== WebSocket.OPEN) return false;
  const [key, message] = live.queue.entries().next().value;
  live.queue.delete(key);
  live.awaiting = true;
  live.socket.send(JSON.stringify(message));
  return true;
}

function receive(text) {
  const message = JSON.parse(text);
  const [answer] = Object.keys(message);
  if (answers[answer]) {
    answers[answer](message[answer]);
    return;
  }
  const first = !live.state;
  // What changes seldom is kept from before.
  for (const key of SELDOM) message[key] ??= live.state?.[key] ?? null;
  live.state = message;
  live.awaiting = false;
  if (!flush()) live.socket.send('{"do":"got"}');
  for (const follower of followers) follower(live.state, first);
}

function connect() {
  if (!data.token) {
    connectAround();
    return;
  }
  const socket = new WebSocket(`ws://${location.host}/live`, [`armwright.${data.token}`]);
  live.socket = socket;
  live.awaiting = false;
  live.queue.clear();
  socket.addEventListener("message", (event) => receive(event.data));
  socket.addEventListener("open", () => {
    live.lost = false;
  });
  socket.addEventListener("close", () => {
    if (live.socket !== socket) return;
    live.lost = true;
    for (const follower of followers) follower(live.state, false);
    setTimeout(connect, RETRY);
  });
}

const mine = () => Boolean(!live.lost && live.state?.ready && live.state.control.mine);
