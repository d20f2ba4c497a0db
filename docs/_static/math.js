// Typesets the formulas of the page with KaTeX. Elements of class "math" hold LaTeX.
for (const element of document.querySelectorAll(".math")) {
  const displayed = element.classList.contains("displayed");
  try {
    katex.render(element.textContent, element, { displayMode: displayed });
  } catch (error) {
    // The formula stays in LaTeX; `make docs-check` reports it.
    element.classList.add("katex-error");
    element.title = error.message;
  }
  // A formula wider than the screen scrolls by itself, also from the keyboard.
  if (displayed && element.scrollWidth > element.clientWidth) element.tabIndex = 0;
}
