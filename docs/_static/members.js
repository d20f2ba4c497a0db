// On a telephone, a page of the reference shows the signatures of the members; a touch shows the description of one.
const MEMBERS = "dl.py.method, dl.py.property, dl.py.attribute";

document.addEventListener("DOMContentLoaded", () => {
  const members = document.querySelectorAll(MEMBERS);
  if (members.length < 8) return;
  document.documentElement.classList.add("folded");
  const open = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const member = target && target.closest(MEMBERS);
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
