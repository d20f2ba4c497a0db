// The Python program of what is on the screen.

/** Numbers of Python. JavaScript writes the fewest digits that give back the same number, as Python does. */
export const literal = (x) =>
  Array.isArray(x) || ArrayBuffer.isView(x) ? `[${Array.from(x, literal).join(", ")}]` : String(x);

/** An assignment of rows, one per line, or in lines of numbers if there are many. */
export function assign(name, rows) {
  if (!Array.isArray(rows[0])) return `${name} = [\n${wrapped(rows)}]`;
  return `${name} = [\n${rows.map((row) => `    ${literal(row)},\n`).join("")}]`;
}

function wrapped(numbers) {
  const lines = [];
  let current = "   ";
  for (const x of numbers) {
    const next = ` ${literal(x)},`;
    if (current.length + next.length > 88) {
      lines.push(current);
      current = "   ";
    }
    current += next;
  }
  return `${[...lines, current].join("\n")}\n`;
}


/** A folded panel with the program and a button that copies it. */
export class CodePanel {
  constructor(element, program) {
    this.program = program;
    element.innerHTML =
      '<summary>Python code of this figure</summary><div class="play-code">' +
      '<button type="button" class="play-copy">Copy</button><pre tabindex="0"><code></code></pre></div>';
    this.element = element;
    this.code = element.querySelector("code");
    const button = element.querySelector("button");
    button.addEventListener("click", async () => {
      const copied = await copy(this.program(), this.code);
      button.textContent = copied ? "Copied" : "Selected";
      setTimeout(() => {
        button.textContent = "Copy";
      }, 1500);
    });
    element.addEventListener("toggle", () => this.update());
  }

  update() {
    if (this.element.open) this.code.textContent = this.program();
  }
}

/** Copies text; pages from a disk may lack the permission, and then the text is selected. */
async function copy(text, code) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    code.textContent = text;
    const range = document.createRange();
    range.selectNodeContents(code);
    getSelection().removeAllRanges();
    getSelection().addRange(range);
    return document.execCommand("copy");
  }
}
