// As much of a client of the Language Server Protocol as the extension needs: no package is fetched.
"use strict";
const { spawn } = require("child_process");

class Client {
  constructor(command, args, onNotification) {
    this.process = spawn(command, args, { stdio: ["pipe", "pipe", "pipe"] });
    this.onNotification = onNotification;
    this.number = 0;
    this.waiting = new Map();
    this.buffer = Buffer.alloc(0);
    this.process.stdout.on("data", (data) => this.received(data));
    this.process.on("error", (error) => this.failed(error));
    this.process.on("exit", () => this.failed(new Error("the server has ended")));
  }

  send(message) {
    const body = Buffer.from(JSON.stringify({ jsonrpc: "2.0", ...message }), "utf8");
    this.process.stdin.write(`Content-Length: ${body.length}\r\n\r\n`);
    this.process.stdin.write(body);
  }

  tell(method, params) {
    this.send({ method, params });
  }

  ask(method, params) {
    const id = ++this.number;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.send({ id, method, params });
    });
  }

  async start() {
    const told = await this.ask("initialize", { processId: process.pid, rootUri: null, capabilities: {} });
    this.tell("initialized", {});
    return told;
  }

  async stop() {
    await this.ask("shutdown", null);
    this.tell("exit", null);
  }

  received(data) {
    this.buffer = Buffer.concat([this.buffer, data]);
    for (;;) {
      const end = this.buffer.indexOf("\r\n\r\n");
      if (end < 0) return;
      const length = Number(/content-length:\s*(\d+)/i.exec(this.buffer.subarray(0, end).toString())[1]);
      if (this.buffer.length < end + 4 + length) return;
      const message = JSON.parse(this.buffer.subarray(end + 4, end + 4 + length).toString("utf8"));
      this.buffer = this.buffer.subarray(end + 4 + length);
      this.dispatch(message);
    }
  }

  dispatch(message) {
    const waiting = message.id !== undefined && !message.method && this.waiting.get(message.id);
    if (waiting) {
      this.waiting.delete(message.id);
      if (message.error) waiting.reject(new Error(message.error.message));
      else waiting.resolve(message.result);
    } else if (message.method && message.id !== undefined) {
      this.send({ id: message.id, result: null });
    } else if (message.method) {
      this.onNotification(message.method, message.params);
    }
  }

  failed(error) {
    for (const { reject } of this.waiting.values()) reject(error);
    this.waiting.clear();
  }
}

module.exports = { Client };
