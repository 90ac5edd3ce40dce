// Light or dark: the system's choice until the reader makes another one.
(() => {
  const root = document.documentElement;
  const remember = (theme) => { try { localStorage.setItem("theme", theme); } catch { /* a page from a file may not */ } };
  try { const theme = localStorage.getItem("theme"); if (theme) root.dataset.theme = theme; } catch { /* as above */ }
  const dark = () => root.dataset.theme
    ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  addEventListener("DOMContentLoaded", () => {
    document.getElementById("theme").onclick = () => {
      root.dataset.theme = dark() ? "light" : "dark";
      remember(root.dataset.theme);
    };
  });
})();
