// From the <video> to the picture's textures: the newest frame only.
//
// "planes" copies the decoder's Y, U, V (exact, and cheap where software draws); "rgb" lets the
// browser convert (cheap on a GPU). A browser that cannot do the first falls back to the second
// and says so in `path`.

import { colorSpace } from './colour.js';

/** @typedef {{receivedMs: number | null, rtp: number | null}} FrameTimes
 * when its last packet came, page time; RTP time stamp as sent */

/** @type {Record<string, number[]>} of each plane, for the pixel formats our shader reads */
const CHANNELS = { I420: [1, 1, 1], NV12: [1, 2] };

export class VideoFeed {
  /**
   * @param {HTMLVideoElement} video @param {import('./picture.js').Picture} picture
   * @param {'planes' | 'rgb'} path
   * @param {(times: FrameTimes) => void} onPicture after each upload
   */
  constructor(video, picture, path, onPicture) {
    this.video = video;
    this.picture = picture;
    this.path = typeof VideoFrame === 'undefined' ? 'rgb' : path;
    this.onPicture = onPicture;
    /** frames the browser decoded and showed us; those it skipped are its own */
    this.presented = 0;
    this.skipped = 0;
    this.errors = 0;
    this.copying = false;
    /** @type {FrameTimes | null} came while copying */
    this.waiting = null;
    this.buffer = new Uint8Array(0);
    this.lastMediaTime = -1;
    this.next();
  }

  next() {
    if (this.video.requestVideoFrameCallback) {
      this.video.requestVideoFrameCallback((_, metadata) => {
        this.presented = Math.max(this.presented + 1, metadata.presentedFrames);
        this.arrived({
          receivedMs: metadata.receiveTime ?? null,
          rtp: metadata.rtpTimestamp ?? null,
        });
        this.next();
      });
    } else {
      requestAnimationFrame(() => this.poll());
    }
  }

  /** For browsers without requestVideoFrameCallback. */
  poll() {
    if (this.video.currentTime !== this.lastMediaTime && this.video.readyState >= 2) {
      this.lastMediaTime = this.video.currentTime;
      this.presented += 1;
      this.arrived({ receivedMs: null, rtp: null });
    }
    this.next();
  }

  /** @param {FrameTimes} times */
  arrived(times) {
    if (!this.video.videoWidth) return;
    if (this.path === 'planes') {
      if (this.waiting) this.skipped += 1;
      this.waiting = times;
      if (!this.copying) this.copyNewest();
    } else {
      this.picture.uploadVideo(this.video);
      this.onPicture(times);
    }
  }

  async copyNewest() {
    this.copying = true;
    while (this.waiting) {
      const times = this.waiting;
      this.waiting = null;
      try {
        await this.copyPlanes();
        this.onPicture(times);
      } catch (error) {
        this.errors += 1;
        this.path = 'rgb';
        console.warn('planes cannot be copied, the browser converts instead:', error);
      }
    }
    this.copying = false;
  }

  async copyPlanes() {
    const frame = new VideoFrame(this.video);
    try {
      const channels = CHANNELS[frame.format ?? ''];
      if (!channels) throw new Error(`pixel format ${frame.format}`);
      const rect = frame.visibleRect ?? new DOMRectReadOnly(0, 0, frame.codedWidth, frame.codedHeight);
      const color = colorSpace(frame.colorSpace, rect.height);
      if (this.buffer.length < frame.allocationSize()) {
        this.buffer = new Uint8Array(frame.allocationSize());
      }
      const layout = await frame.copyTo(this.buffer);
      this.picture.uploadPlanes(planesOf(this.buffer, layout, channels, rect), color);
    } finally {
      frame.close();
    }
  }
}

/** @param {Uint8Array} buffer @param {{offset: number, stride: number}[]} layout
 * @param {number[]} channels @param {{width: number, height: number}} rect
 * @returns {import('./picture.js').Plane[]} */
function planesOf(buffer, layout, channels, rect) {
  return layout.map(({ offset, stride }, i) => ({
    width: i ? Math.ceil(rect.width / 2) : rect.width,
    height: i ? Math.ceil(rect.height / 2) : rect.height,
    channels: /** @type {1 | 2} */ (channels[i]),
    stride,
    bytes: buffer.subarray(offset),
  }));
}
