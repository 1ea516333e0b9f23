"use strict";
(() => {
  const make = (name, set, ...inside) => {
    const made = Object.assign(document.createElement(name), set);
    made.append(...inside);
    return made;
  };

  // Tables: a button in each head sorts the rows, numbers by data-sort, and the empty ones last.
  document.querySelectorAll("table.sortable").forEach((table) => {
    const heads = [...table.tHead.rows[0].cells];
    const body = table.tBodies[0];
    heads.forEach((head, column) => {
      const button = make("button", { type: "button" }, ...head.childNodes);
      head.append(button);
      head.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        heads.forEach((other) => other.setAttribute("aria-sort", "none"));
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const key = (row) => {
          const cell = row.cells[column];
          if (!("sort" in cell.dataset)) return cell.textContent;
          return cell.dataset.sort === "" ? NaN : Number(cell.dataset.sort);
        };
        const order = (a, b) => {
          if (typeof a === "string") return (down ? -1 : 1) * a.localeCompare(b, "en", { numeric: true });
          if (isNaN(a) || isNaN(b)) return isNaN(a) - isNaN(b);
          return down ? b - a : a - b;
        };
        body.append(...[...body.rows].sort((a, b) => order(key(a), key(b))));
      });
    });
  });

  // Charts: a point's title becomes a tooltip that the keyboard reaches, too. The arrow keys go
  // from point to point.
  const tip = make("div", { id: "tip", hidden: true });
  tip.setAttribute("role", "status");
  document.body.append(tip);
  const hide = () => { tip.hidden = true; };
  document.querySelectorAll(".chart > svg").forEach((chart) => {
    const points = [...chart.querySelectorAll(".point")].sort((a, b) => a.dataset.x - b.dataset.x);
    points.forEach((point, index) => {
      const title = point.querySelector("title");
      const text = title.textContent;
      title.remove();
      point.setAttribute("aria-label", text.replaceAll("\n", "; "));
      point.setAttribute("tabindex", index === 0 ? "0" : "-1");
      const show = () => {
        tip.textContent = text;
        tip.hidden = false;
        const box = point.getBoundingClientRect();
        const width = document.documentElement.clientWidth;
        const left = Math.max(8, Math.min(box.right + 8, width - tip.offsetWidth - 8));
        tip.style.left = `${left + scrollX}px`;
        tip.style.top = `${box.bottom + 8 + scrollY}px`;
      };
      point.addEventListener("mouseenter", show);
      point.addEventListener("focus", show);
      point.addEventListener("mouseleave", hide);
      point.addEventListener("blur", hide);
      point.addEventListener("keydown", (event) => {
        const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
        if (event.key === "Escape") hide();
        const next = step && points[index + step];
        if (!next) return;
        event.preventDefault();
        points.forEach((other) => other.setAttribute("tabindex", "-1"));
        next.setAttribute("tabindex", "0");
        next.focus();
      });
    });
  });

  // Images: two of a gallery on top of each other, and a slider that says where the right one begins.
  document.querySelectorAll(".compare").forEach((place) => {
    const all = [...document.querySelectorAll("img[data-name]")];
    if (all.length < 2) return;
    const range = make("input", { type: "range", min: 0, max: 100, step: 0.5, value: 50 });
    range.setAttribute("aria-label", "Where the right image begins, in percent of the width");
    const stack = make("div", { className: "stack" });
    const choices = make("div", { className: "choose" });
    ["left", "right"].forEach((side) => {
      const image = make("img", {});
      const select = make("select", {}, ...all.map((one) => make("option", { value: one.id }, one.dataset.name)));
      const show = () => {
        const chosen = document.getElementById(select.value);
        image.src = chosen.src;
        image.alt = `${side}: ${chosen.dataset.name}`;
      };
      select.value = place.dataset[side];
      select.addEventListener("change", show);
      show();
      stack.append(image);
      const label = side === "left" ? "Left: " : "Right: ";
      choices.append(make("label", {}, label, select));
    });
    const cut = () => stack.style.setProperty("--cut", `${range.value}%`);
    range.addEventListener("input", cut);
    const drag = (event) => {
      if (event.type === "pointermove" && event.buttons === 0) return;
      const box = stack.getBoundingClientRect();
      range.value = (100 * (event.clientX - box.left)) / box.width;
      cut();
    };
    stack.addEventListener("pointerdown", drag);
    stack.addEventListener("pointermove", drag);
    stack.addEventListener("dragstart", (event) => event.preventDefault());
    place.append(choices, stack, range);
    place.hidden = false;
  });

  // Commands: a button copies each.
  document.querySelectorAll(".command").forEach((place) => {
    const code = place.querySelector("code");
    const button = make("button", { type: "button" }, "Copy");
    button.addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(code.textContent);
        button.textContent = "Copied";
      } catch {
        getSelection().selectAllChildren(code);
        button.textContent = "Selected";
      }
      setTimeout(() => { button.textContent = "Copy"; }, 1500);
    });
    place.append(button);
  });
})();
