// On a telephone, a page of the reference shows the signatures of the members; a touch shows the description of one.
document.addEventListener("DOMContentLoaded", () => {
  const members = document.querySelectorAll(".bd-article dl.py dl.py");
  if (members.length < 8) return;
  document.documentElement.classList.add("folded");
  const open = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const member = target && target.closest("dl.py dl.py");
    if (member) {
      member.classList.add("open");
      target.scrollIntoView();
    }
  };
  for (const member of members) {
    member.querySelector("dt").addEventListener("click", (event) => {
      if (!event.target.closest("a")) member.classList.toggle("open");
    });
  }
  addEventListener("hashchange", open);
  open();
});
