// The pictures that cameras took, in a strip: when, by which, and what was found.

function pictureItem(picture) {
  const image = make("img", {
    src: `data:image/png;base64,${picture.png}`,
    alt: `Picture of ${picture.camera} at ${number(picture.t, 2)} s`,
    loading: "lazy",
  });
  const badge = make("span", {
    className: picture.found ? "badge good" : "badge",
    textContent: picture.found ? "found" : "not found",
  });
  const head = make("span", {}, make("b", { textContent: `${number(picture.t, 2)} s` }), ` ${picture.camera}`);
  const button = make(
    "button",
    { type: "button" },
    image,
    make("span", { className: "card-head" }, head, badge),
    make("span", { textContent: picture.frame }),
    make("span", { className: "quiet", textContent: picture.text }),
  );
  button.addEventListener("click", () => seek(picture.t));
  return make("li", {}, button);
}

function fillPictures() {
  byId("pictures-card").hidden = !data.pictures.length;
  byId("pictures").append(...data.pictures.map(pictureItem));
}

let shownPicture = null;

// The last picture that was taken is marked, and comes into sight.
function showPictures() {
  const present = data.pictures.findLastIndex((picture) => picture.t <= now.t + HAIR);
  if (present === shownPicture) return;
  shownPicture = present;
  const strip = byId("pictures");
  [...strip.children].forEach((item, i) => {
    item.classList.toggle("now", i === present);
  });
  const item = strip.children[present];
  if (item) strip.scrollLeft = item.offsetLeft - (strip.clientWidth - item.offsetWidth) / 2;
}
