// window.muslinViewers: the players of the page in the order in which they stand there.

window.muslinViewers = [];

// Makes players of what has not been started; each unpacks its data once it comes near the window.
window.muslinViewers.start = () => {
  const near = new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries)
        if (isIntersecting) {
          near.unobserve(target);
          target.muslinStart();
        }
    },
    { rootMargin: "600px" },
  );
  for (const root of document.querySelectorAll(".muslin-viewer:not([data-started])")) {
    root.dataset.started = "";
    const index = window.muslinViewers.push(null) - 1;
    root.muslinStart = () => {
      const script = root.querySelector("script");
      const data = JSON.parse(script.textContent);
      script.remove();
      const player = (window.muslinViewers[index] = new Player(root, data));
      player.ready.catch((error) => {
        root.append(element("p", { class: "mv-missing", role: "alert" }, `The frames cannot be unpacked: ${error.message}`));
        console.error(error);
      });
    };
    near.observe(root);
  }
};
