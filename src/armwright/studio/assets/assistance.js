// Help while writing: what can be written at the caret, and what stands under the pointer.

const PAUSE = 450; // the pointer rests so long before what it rests on is told [ms]
const helping = { items: [], chosen: 0, text: "", place: null, timer: null, asked: 0 };

// Offsets into a text are counted in characters by the server, and in halves of some of them by a browser.
const countOf = (text, offset) => [...text.slice(0, offset)].length;
const offsetOf = (text, count) => [...text].slice(0, count).join("").length;

function characterSize() {
  const style = getComputedStyle(byId("text"));
  const measure = document.createElement("canvas").getContext("2d");
  measure.font = `${style.fontSize} ${style.fontFamily}`;
  return [measure.measureText("0".repeat(20)).width / 20, parseFloat(style.lineHeight)];
}

// Where a character of the text is drawn, from the left and the top of the editor.
function placeOf(offset) {
  const field = byId("text");
  const before = field.value.slice(0, offset).split("\n");
  const [wide, high] = characterSize();
  return [8 + before.at(-1).length * wide - field.scrollLeft, 6 + before.length * high - field.scrollTop];
}

function offsetAt(x, y) {
  const field = byId("text");
  const [wide, high] = characterSize();
  const lines = field.value.split("\n");
  const [line, column] = [Math.floor((y - 6 + field.scrollTop) / high), Math.floor((x - 8 + field.scrollLeft) / wide)];
  if (line < 0 || line >= lines.length || column < 0 || column >= lines[line].length) return null;
  return lines.slice(0, line).reduce((sum, text) => sum + text.length + 1, 0) + column;
}

function askForCompletions() {
  const field = byId("text");
  if (field.readOnly) return;
  helping.text = field.value;
  helping.place = field.selectionStart;
  send({ do: "complete", text: field.value, offset: countOf(field.value, field.selectionStart) }, "complete");
}

function takeCompletions(items) {
  const field = byId("text");
  if (field.value !== helping.text || field.selectionStart !== helping.place || document.activeElement !== field) return;
  // The server matches what it knows with the place, the page with the letters that stand there.
  const typed = ({ start }) => field.value.slice(offsetOf(field.value, start), helping.place).toUpperCase();
  const fits = items.filter((item) => item.label.toUpperCase().startsWith(typed(item)) && item.text.toUpperCase() !== typed(item));
  helping.items = fits.slice(0, 12);
  helping.chosen = 0;
  showCompletions();
}

function showCompletions() {
  const list = byId("completions");
  const { items, chosen } = helping;
  const field = byId("text");
  list.hidden = !items.length;
  if (!items.length) {
    field.removeAttribute("aria-activedescendant");
    return;
  }
  list.replaceChildren(
    ...items.map((item, i) => {
      const row = make("li", { id: `completion-${i}`, role: "option" }, make("b", { textContent: item.label }), make("small", { textContent: item.detail }));
      row.ariaSelected = String(i === chosen);
      row.addEventListener("pointerdown", (event) => {
        event.preventDefault();
        acceptCompletion(i);
      });
      return row;
    }),
  );
  field.setAttribute("aria-activedescendant", `completion-${chosen}`);
  const box = byId("code").getBoundingClientRect();
  const [x, y] = placeOf(helping.place);
  list.style.left = `${Math.max(4, Math.min(box.left + x, innerWidth - 350))}px`;
  // Below the line that is written, or above it.
  const below = box.top + y + 2;
  const above = below + list.offsetHeight > innerHeight;
  list.style.top = `${above ? Math.max(4, below - list.offsetHeight - 24) : below}px`;
  list.children[chosen].scrollIntoView({ block: "nearest" });
}

function closeCompletions() {
  helping.items = [];
  showCompletions();
}

function acceptCompletion(i) {
  const field = byId("text");
  const { start, end, text } = helping.items[i];
  closeCompletions();
  field.setRangeText(text, offsetOf(field.value, start), Math.max(offsetOf(field.value, end), field.selectionStart), "end");
  field.dispatchEvent(new Event("input"));
  closeCompletions();
}

function onEditorKey(event) {
  const { items, chosen } = helping;
  if (event.key === " " && event.ctrlKey) {
    event.preventDefault();
    askForCompletions();
    return;
  }
  if (event.key === "F1") {
    event.preventDefault();
    describe(event.target.selectionStart, placeOf(event.target.selectionStart));
    return;
  }
  if (!items.length) return;
  const keys = {
    ArrowDown: () => (helping.chosen = (chosen + 1) % items.length),
    ArrowUp: () => (helping.chosen = (chosen + items.length - 1) % items.length),
  };
  if (keys[event.key]) {
    keys[event.key]();
    showCompletions();
  } else if (event.key === "Enter" || event.key === "Tab") acceptCompletion(chosen);
  else if (event.key === "Escape") closeCompletions();
  else return;
  event.preventDefault();
  event.stopImmediatePropagation();
}

function describe(offset, [x, y]) {
  if (!mine()) return;
  if (editor.timer) sendText();
  helping.tip = [x, y];
  send({ do: "describe", offset: countOf(byId("text").value, offset) }, "describe");
}

function takeDescription(text) {
  const tip = byId("description");
  tip.hidden = !text || !helping.tip;
  tip.textContent = text;
  if (tip.hidden) return;
  const [x, y] = helping.tip;
  tip.style.left = `${Math.max(0, Math.min(x, byId("code").clientWidth - 260))}px`;
  tip.style.top = `${y + 4}px`;
}

function hideDescription() {
  clearTimeout(helping.timer);
  helping.tip = null;
  byId("description").hidden = true;
}

function startAssistance() {
  const field = byId("text");
  // Before the editor's own keys: Tab and Escape mean something else while there is a list.
  field.addEventListener("keydown", onEditorKey, true);
  field.addEventListener("input", (event) => {
    hideDescription();
    const before = field.value.slice(0, field.selectionStart);
    if (event.isTrusted && /[A-Za-z_][\w]*$/.test(before) && event.inputType === "insertText") askForCompletions();
    else closeCompletions();
  });
  for (const end of ["blur", "scroll", "pointerdown"]) field.addEventListener(end, closeCompletions);
  field.addEventListener("pointermove", (event) => {
    hideDescription();
    if (event.pointerType === "touch") return;
    const box = field.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    helping.timer = setTimeout(() => {
      const offset = offsetAt(x, y);
      if (offset !== null) describe(offset, [x, y + 14]);
    }, PAUSE);
  });
  for (const end of ["pointerleave", "keydown"]) field.addEventListener(end, (event) => event.key === "F1" || hideDescription());
  answers.completions = takeCompletions;
  answers.description = takeDescription;
}
