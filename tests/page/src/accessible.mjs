// What a person with a keyboard, a screen reader or weak sight needs of a page.

/** Least contrast of a text (WCAG 2.2, 1.4.3, level AA). */
const CONTRAST = 4.5;

/** Returns the controls without a name, and the texts that are too faint. Runs in the page. */
function examine(least) {
  const isVisible = (element) => element.checkVisibility() && !element.closest("[inert]");
  const all = [...document.querySelectorAll("body *")].filter(isVisible);
  const name = (element) =>
    element.ariaLabel ?? element.labels?.[0]?.textContent ??
    document.getElementById(element.getAttribute("aria-labelledby"))?.textContent ??
    element.textContent;
  const controls = all.filter((element) => element.matches("button, input, select, canvas"));
  const unnamed = controls.filter((element) => !name(element)?.trim());

  const numbers = (colour) => {
    const [r, g, b, a = 1] = colour.match(/[\d.]+/g).map(Number);
    return { rgb: [r, g, b], a };
  };
  const over = ({ rgb, a }, below) => rgb.map((value, k) => a * value + (1 - a) * below[k]);
  const background = (element) => {
    if (!element) return [255, 255, 255];
    const colour = numbers(getComputedStyle(element).backgroundColor);
    return colour.a === 1 ? colour.rgb : over(colour, background(element.parentElement));
  };
  const luminance = (rgb) => {
    const [r, g, b] = rgb
      .map((value) => value / 255)
      .map((s) => (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (element) => {
    const below = background(element);
    const { rgb, a } = numbers(getComputedStyle(element).color);
    let opacity = a;
    for (let each = element; each; each = each.parentElement) {
      opacity *= Number(getComputedStyle(each).opacity);
    }
    const [dark, light] = [luminance(over({ rgb, a: opacity }, below)), luminance(below)].sort();
    return (light + 0.05) / (dark + 0.05);
  };
  const hasText = (element) =>
    [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
  const faint = all.filter((each) => hasText(each) && !each.closest(":disabled, option"))
    .map((each) => ({ each, value: contrast(each) }))
    .filter(({ value }) => value < least)
    .map(({ each, value }) => `${each.textContent.trim()}: ${value.toFixed(2)}`);
  return { unnamed: unnamed.map((element) => element.outerHTML), faint };
}

/** Returns what is wrong with a tab's page. */
export function shortcomings(tab) {
  return tab.evaluate(`(${examine})(${CONTRAST})`);
}

/** Returns the contrast of two colours of the form "#rrggbb". */
export function contrast(...colours) {
  const luminances = colours.map((colour) => {
    const [r, g, b] = colour.match(/[0-9a-f]{2}/gi)
      .map((digits) => Number.parseInt(digits, 16) / 255)
      .map((s) => (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  });
  return (Math.max(...luminances) + 0.05) / (Math.min(...luminances) + 0.05);
}
