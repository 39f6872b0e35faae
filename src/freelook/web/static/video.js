// From the stream to the picture's textures: the newest frame only.
//
// Where the browser hands out decoded frames (MediaStreamTrackProcessor) they are taken as soon as
// they are decoded; elsewhere from a <video>, which shows them a display frame or two later.
//
// "planes" copies the decoder's Y, U, V (exact, and cheap where software draws); "rgb" lets the
// browser convert (cheap on a GPU). A browser that cannot do the first falls back to the second
// and says so in `path`.

import { colorSpace } from './colour.js';

/** @typedef {{receivedMs: number | null, rtp: number | null}} FrameTimes
 * when it came to this page, page time; RTP time stamp as sent */

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
    /** frames the browser decoded and gave us; those it skipped are its own */
    this.presented = 0;
    this.errors = 0;
    this.buffer = new Uint8Array(0);
    /** @type {ReadableStreamDefaultReader<VideoFrame> | null} */
    this.reader = null;
    /** one upload at a time; frames from the <video> meanwhile wait, the newest only */
    this.copying = false;
    /** @type {FrameTimes | null} */
    this.waiting = null;
    this.lastMediaTime = -1;
    if (!canReadFrames()) this.watch();
  }

  /** Show this stream from now on. Rejects like HTMLMediaElement.play.
   * @param {MediaStream} stream */
  async play(stream) {
    const [track] = stream.getVideoTracks();
    if (track && canReadFrames()) {
      this.read(track);
    } else {
      this.video.srcObject = stream;
      await this.video.play();
    }
  }

  /** The last picture stays. */
  stop() {
    this.reader?.cancel().catch(() => {});
    this.reader = null;
    this.video.srcObject = null; // or the browser shows a black frame
  }

  /** @param {MediaStreamTrack} track */
  async read(track) {
    this.stop();
    // @ts-ignore: not in TypeScript's library
    const reader = new MediaStreamTrackProcessor({ track, maxBufferSize: 1 }).readable.getReader();
    this.reader = reader;
    while (reader === this.reader) {
      /** @type {{value?: VideoFrame, done: boolean}} */
      const { value: frame, done } = await reader.read().catch(() => ({ done: true }));
      if (done || !frame) return;
      try {
        if (reader === this.reader) await this.take(frame);
      } finally {
        frame.close();
      }
    }
  }

  /** @param {VideoFrame} frame */
  async take(frame) {
    this.presented += 1;
    // @ts-ignore: not in TypeScript's library
    const rtp = frame.metadata?.().rtpTimestamp ?? null;
    const times = { receivedMs: performance.now(), rtp };
    if (this.path === 'planes') await this.orElseRgb(() => this.copyPlanes(frame));
    if (this.path === 'rgb') {
      this.picture.uploadFrame(frame, frame.displayWidth, frame.displayHeight);
    }
    this.onPicture(times);
  }

  /** Wait for the <video>'s next frame. */
  watch() {
    if (this.video.requestVideoFrameCallback) {
      this.video.requestVideoFrameCallback((_, metadata) => {
        this.presented = Math.max(this.presented + 1, metadata.presentedFrames);
        const { receiveTime, rtpTimestamp } = metadata;
        this.arrived({ receivedMs: receiveTime ?? null, rtp: rtpTimestamp ?? null });
        this.watch();
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
    this.watch();
  }

  /** @param {FrameTimes} times */
  arrived(times) {
    if (!this.video.videoWidth) return;
    if (this.path === 'planes') {
      this.waiting = times;
      if (!this.copying) this.copyNewest();
    } else {
      this.picture.uploadFrame(this.video, this.video.videoWidth, this.video.videoHeight);
      this.onPicture(times);
    }
  }

  async copyNewest() {
    this.copying = true;
    while (this.waiting) {
      const times = this.waiting;
      this.waiting = null;
      const frame = new VideoFrame(this.video);
      await this.orElseRgb(() => this.copyPlanes(frame));
      frame.close();
      if (this.path === 'planes') this.onPicture(times);
    }
    this.copying = false;
  }

  /** @param {() => Promise<void>} copy */
  async orElseRgb(copy) {
    try {
      await copy();
    } catch (error) {
      this.errors += 1;
      this.path = 'rgb';
      console.warn('planes cannot be copied, the browser converts instead:', error);
    }
  }

  /** @param {VideoFrame} frame */
  async copyPlanes(frame) {
    const channels = { I420: [1, 1, 1], NV12: [1, 2] }[frame.format ?? ''];
    if (!channels) throw new Error(`pixel format ${frame.format}`);
    const rect = frame.visibleRect ?? new DOMRectReadOnly(0, 0, frame.codedWidth, frame.codedHeight);
    const color = colorSpace(frame.colorSpace, rect.height);
    if (this.buffer.length < frame.allocationSize()) {
      this.buffer = new Uint8Array(frame.allocationSize());
    }
    const layout = await frame.copyTo(this.buffer);
    this.picture.uploadPlanes(planesOf(this.buffer, layout, channels, rect), color);
  }
}

const canReadFrames = () => 'MediaStreamTrackProcessor' in window && 'VideoFrame' in window;

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
