// A host program in Node. Arguments: a port or a TCP address, and `lines` if it also sets and
// reads the modem lines.
const [name, lines] = process.argv.slice(2);

function open() {
  const [host, number] = name.split(':');
  if (number) return require('net').connect(Number(number), host);
  const { SerialPort } = require('serialport');
  return new SerialPort({ path: name, baudRate: 19200 });
}

function fail(error) {
  console.error(String(error));
  process.exit(1);
}

async function main() {
  const port = open();
  port.on('error', fail);
  let heard = '';
  let arrived = () => {};
  port.on('data', bytes => { heard += bytes.toString('latin1'); arrived(); });
  async function ask(line, count) {
    port.write(Buffer.from(line, 'latin1'));
    while (heard.length < count) await new Promise(resolve => { arrived = resolve; });
    const answer = heard.slice(0, count);
    heard = heard.slice(count);
    return answer;
  }
  let answers = await ask('@01\r', 1);
  await ask('@0A20000,10000\r', 0);
  await new Promise(resolve => setTimeout(resolve, 300));
  answers += await ask('\xfd', 1) + await ask('@0S\r', 1) + await ask('@0P\r', 19);
  console.log(answers);
  if (lines) {
    const call = (method, ...rest) => new Promise((resolve, reject) => {
      port[method](...rest, (error, value) => (error ? reject(error) : resolve(value)));
    });
    const failed = [];
    await call('set', { dtr: false, rts: true }).catch(error => failed.push(error.message));
    const now = await call('get').catch(error => failed.push(error.message));
    if (failed.length > 0) fail(failed.join('\n'));
    console.log(`CTS ${Number(now.cts)} DSR ${Number(now.dsr)} DCD ${Number(now.dcd)}`);
  }
  if (port.close) port.close();
  else port.end();
}

main().catch(fail);
