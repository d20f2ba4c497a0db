export class States {}
