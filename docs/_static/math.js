// Typesets the formulas of the page with KaTeX. Elements of class "math" hold LaTeX.
for (const element of document.querySelectorAll(".math")) {
  const displayed = element.classList.contains("displayed");
  katex.render(element.textContent, element, { displayMode: displayed, throwOnError: false });
  // A formula wider than the screen scrolls by itself, also from the keyboard.
  if (displayed && element.scrollWidth > element.clientWidth) element.tabIndex = 0;
}
