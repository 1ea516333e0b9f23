// Files that a user drops or picks, with their paths, and which of them is the scene.

const SCENES = [".ron", ".glb", ".gltf", ".pbrt", ".xml", ".obj", ".ply", ".stl"];
const PANORAMAS = [".hdr", ".exr", ".pfm"];
// WebAssembly addresses 4 GiB, and a scene needs several times its files.
const MOST_BYTES = 2 ** 29;

export class FileError extends Error {}

const hasExtension = (path, extensions) => extensions.some((extension) => path.toLowerCase().endsWith(extension));
const mebibytes = (bytes) => `${(bytes / 2 ** 20).toFixed(bytes < 2 ** 20 ? 2 : 0)} MiB`;

async function inFolder(entry, files) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    files.push([entry.fullPath.slice(1), file]);
    return;
  }
  const reader = entry.createReader();
  for (;;) {
    const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (entries.length === 0) return;
    for (const inner of entries) await inFolder(inner, files);
  }
}

// Returns pairs of path and file of what was dropped, also within folders.
export async function dropped(transfer) {
  const files = [];
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  for (const entry of entries) await inFolder(entry, files);
  return entries.length > 0 ? files : picked(transfer.files);
}

// Returns pairs of path and file of what was picked.
export function picked(list) {
  return [...list].map((file) => [file.webkitRelativePath || file.name, file]);
}

// Returns { scene, panorama, files } of pairs of path and file; files are pairs of path and bytes.
export async function read(pairs) {
  const size = pairs.reduce((sum, [, file]) => sum + file.size, 0);
  if (size > MOST_BYTES) {
    throw new FileError(`The files have ${mebibytes(size)}; a page can read at most ${mebibytes(MOST_BYTES)}.`);
  }
  const of = (extensions) => pairs.map(([path]) => path).filter((path) => hasExtension(path, extensions));
  // Of several kinds the first in the list leads: a scene file names its models.
  const scenes = SCENES.flatMap((extension) => of([extension]));
  const panorama = of(PANORAMAS)[0];
  if (scenes.length === 0 && !panorama) {
    throw new FileError(`No scene among these files: give one of ${SCENES.join(", ")}, or a panorama, ${PANORAMAS.join(", ")}.`);
  }
  const files = [];
  for (const [path, file] of pairs) {
    const bytes = await file.arrayBuffer().catch((error) => {
      throw new FileError(`${path} cannot be read: ${error.message}`);
    });
    files.push([path, bytes]);
  }
  return { scene: scenes[0], panorama: scenes.length === 0 ? panorama : undefined, files };
}
