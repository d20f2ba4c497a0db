export class Construction {}
